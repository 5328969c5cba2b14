"""Errors of hits and of places, against errors that are planted and known on paper."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import warp as wp

from ldtrefl.compare import metrics
from ldtrefl.compare.metrics import hit_errors, reprojection_errors
from ldtrefl.frame.first_hits import FirstHits
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Camera, Material, Object, Scene

TEXELS = np.array([0.25, 2.0])
"""Lengths in the world of a texel of two objects."""


def first_hits(objects: np.ndarray, distance: np.ndarray, units: float = 4.0) -> FirstHits:
    """Hits of one ray a pixel: (h, w) objects and distances in the world, ``units`` device units in one of those."""
    shape = objects.shape
    ends = {
        "t": wp.array((units * distance).ravel().astype(np.float32), dtype=float, device="cpu"),
        "object": wp.array(objects.ravel(), dtype=wp.int32, device="cpu"),
        "triangle": wp.zeros(objects.size, dtype=wp.int32, device="cpu"),
    }
    pixel = wp.array(np.arange(objects.size), dtype=wp.int32, device="cpu")
    return FirstHits((shape[0], shape[1]), SimpleNamespace(pixel=pixel), SimpleNamespace(**ends), units)


def ten_by_ten() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Objects, distances and mask of a picture: 50 rays meet object 0, 10 object 1, 20 nothing; 20 are masked out."""
    objects = np.full(100, -1)
    objects[:50], objects[50:60] = 0, 1
    objects[80:] = 0
    distance = np.where(objects >= 0, 3.0 + 0.01 * np.arange(100), np.inf)
    mask = np.arange(100) < 80
    return objects.reshape(10, 10), distance.reshape(10, 10), mask.reshape(10, 10)


def test_hits_misses_and_objects_that_are_wrong_are_counted() -> None:
    objects, distance, mask = ten_by_ten()
    truth = first_hits(objects, distance)
    assert vars(hit_errors(truth, truth, TEXELS, mask)) == dict.fromkeys(
        ("wrong_hits", "wrong_misses", "wrong_objects", "median", "p99"), 0.0
    )
    changed, along = objects.copy().ravel(), distance.copy().ravel()
    changed[60:63], along[60:63] = (0, 1, 0), 5.0  # nothing is there
    changed[[0, 1, 2, 50, 51, 52]], along[[0, 1, 2, 50, 51, 52]] = -1, np.inf
    changed[[10, 55]] = (1, 0)  # the other object, at the very distance
    changed[80:90], along[80:90] = -1, np.inf  # outside the mask
    changed[90:], along[90:] = 1, 1.0
    found = hit_errors(first_hits(changed.reshape(10, 10), along.reshape(10, 10)), truth, TEXELS, mask)
    assert found.wrong_hits == pytest.approx(100 * 3 / 60)
    assert found.wrong_misses == pytest.approx(100 * 6 / 60)
    assert found.wrong_objects == pytest.approx(100 * 2 / 60)
    assert found.median == found.p99 == 0.0


def test_distances_are_in_texels_of_the_object_that_is_truly_hit() -> None:
    """200 rays off by 0.00 to 1.99 texels, this way and that: the ranks of the median and the 99th percentile."""
    count = 200
    objects = (np.arange(count) % 2).reshape(10, 20)
    distance = np.full(objects.shape, 7.0)
    off = 0.01 * np.random.default_rng(0).permutation(count).reshape(objects.shape)
    sign = np.where(np.arange(count).reshape(objects.shape) % 3 == 0, 1.0, -1.0)
    moved = first_hits(objects, distance + sign * off * TEXELS[objects])
    found = hit_errors(moved, first_hits(objects, distance), TEXELS, np.ones(objects.shape, bool))
    assert found.median == pytest.approx(0.99, abs=1e-4)
    assert found.p99 == pytest.approx(1.97, abs=1e-4)
    assert found.wrong_hits == found.wrong_misses == found.wrong_objects == 0.0


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_distances_that_are_no_numbers_are_infinite_errors(value: float) -> None:
    objects, distance, mask = ten_by_ten()
    truth = first_hits(objects, distance)
    some, most = distance.copy(), distance.copy()
    some[0, 0] = value
    most[:4] = value
    found = hit_errors(first_hits(objects, some), truth, TEXELS, mask)
    assert found.median == 0.0 and found.p99 == np.inf
    assert hit_errors(first_hits(objects, most), truth, TEXELS, mask).median == np.inf


def test_where_the_truth_hits_nothing() -> None:
    nothing, distance = np.full((4, 4), -1), np.full((4, 4), np.inf)
    truth, mask = first_hits(nothing, distance), np.ones((4, 4), bool)
    same = hit_errors(truth, truth, TEXELS, mask)
    assert same.wrong_hits == same.wrong_misses == same.wrong_objects == 0.0 and np.isnan(same.median)
    one = nothing.copy()
    one[1, 1] = 0
    assert hit_errors(first_hits(one, np.full((4, 4), 1.0)), truth, TEXELS, mask).wrong_hits == np.inf
    # All are missed: no distance is compared, and none is right by that.
    missed = hit_errors(truth, first_hits(one, np.full((4, 4), 1.0)), TEXELS, mask)
    assert missed.wrong_misses == 100.0 and np.isnan(missed.p99)


HEIGHT, CEILING, SIDE, FIELD = 3.0, 5.0, 33, 8.0
"""Of the camera over the mirror, of the sheet over the mirror, pixels along a side, degrees."""


def mirrored_sheet(tilt: float, **changes: Any) -> tuple[FirstHits, Any]:
    """Hits and G-buffer of a camera that looks straight down into a flat mirror, which shows a sheet above the camera,
    tilted by ``tilt`` degrees."""
    mirror = Object(shape="plane", scale=1.0, material=Material(albedo=(0, 0, 0), mirror=(1, 1, 1)))
    sheet = Object(shape="plane", scale=20.0, rotate=(1, 0, 0, 180.0 + tilt), translate=(0, 0, CEILING))
    camera = Camera(eye=(0, 0, HEIGHT), look_at=(0, 0, 0), up=(0, 1, 0), width=SIDE, height=SIDE, fov_y=FIELD)
    scene = Scene(camera=camera, objects=changes.get("objects", (mirror, sheet)))
    renderer = Renderer(scene, "bvh")
    frame = renderer.render()
    assert frame.hits is not None and renderer.gbuffer is not None
    return frame.hits, renderer.gbuffer


def moved_along(truth: FirstHits, off: Any) -> FirstHits:
    """The same hits, ``off`` farther along their rays."""
    return first_hits(truth.object, truth.distance + off, truth.device_units_per_world_unit)


@pytest.mark.parametrize("tilt", [20.0, 45.0, 70.0])
@pytest.mark.parametrize("off", [-0.01, 0.02])
def test_what_lies_behind_its_place_is_seen_pixels_beside_it(tilt: float, off: float) -> None:
    """On the axis a point ``off`` along the ray shows what lies ``off * sin * cos`` beside. A pixel is as wide there as
    in a picture taken through the mirror: the camera's height plus the sheet's, times the angle of a pixel."""
    truth, gbuffer = mirrored_sheet(tilt)
    assert truth.distance[SIDE // 2, SIDE // 2] == pytest.approx(CEILING, rel=1e-5)
    errors = reprojection_errors(moved_along(truth, off), truth, gbuffer)
    assert errors.shape == ((SIDE - 1) ** 2,)
    angle = np.radians(tilt)
    pixel = (HEIGHT + CEILING) * 2 * np.tan(np.radians(FIELD / 2)) / SIDE
    centre = errors.reshape(SIDE - 1, SIDE - 1)[SIDE // 2, SIDE // 2]
    assert centre == pytest.approx(abs(off) * np.sin(angle) * np.cos(angle) / pixel, rel=2e-3)
    assert (reprojection_errors(truth, truth, gbuffer) == 0.0).all()


def test_what_is_met_head_on_is_seen_in_its_place() -> None:
    truth, gbuffer = mirrored_sheet(0.0)
    errors = reprojection_errors(moved_along(truth, 0.02), truth, gbuffer).reshape(SIDE - 1, SIDE - 1)
    pixel = (HEIGHT + CEILING) * 2 * np.tan(np.radians(FIELD / 2)) / SIDE
    assert errors[SIDE // 2, SIDE // 2] < 1e-3 * 0.02 / pixel
    # Farther out by the angle of the ray alone, here to the left of the middle, 4 degrees at the rim.
    angle = np.arctan(2 * np.tan(np.radians(FIELD / 2)) * (SIDE // 2) / SIDE)
    assert errors[SIDE // 2, 0] == pytest.approx(0.02 * np.sin(angle) * np.cos(angle) / pixel, rel=0.02)


def test_planted_errors_come_out_one_by_one() -> None:
    """One ray in ten moved: as many errors as rays moved, each at its pixel; no number, and misses."""
    truth, gbuffer = mirrored_sheet(45.0)
    rng = np.random.default_rng(1)
    planted = rng.random((SIDE, SIDE)) < 0.1
    errors = reprojection_errors(moved_along(truth, np.where(planted, 0.05, 0.0)), truth, gbuffer)
    np.testing.assert_array_equal(errors.reshape(SIDE - 1, SIDE - 1) > 0.0, planted[:-1, :-1])
    broken = reprojection_errors(moved_along(truth, np.where(planted, np.nan, 0.0)), truth, gbuffer)
    np.testing.assert_array_equal(np.isinf(broken).reshape(SIDE - 1, SIDE - 1), planted[:-1, :-1])
    assert not np.isnan(broken).any()
    missed = np.where(planted, -1, truth.object)
    lost = first_hits(missed, np.where(planted, np.inf, truth.distance), truth.device_units_per_world_unit)
    assert len(reprojection_errors(lost, truth, gbuffer)) == (~planted[:-1, :-1]).sum()


def test_rays_beside_another_mirror_are_left_out() -> None:
    """Two mirrors side by side, meeting in the middle column: left of the seam there is no distance between rays."""
    half = Material(albedo=(0, 0, 0), mirror=(1, 1, 1))
    sheet = Object(shape="plane", scale=20.0, rotate=(1, 0, 0, 210.0), translate=(0, 0, CEILING))
    mirrors = [Object(shape="plane", translate=(side, 0, 0), material=half) for side in (-1.001, 0.999)]
    truth, gbuffer = mirrored_sheet(0.0, objects=(*mirrors, sheet))
    seen = gbuffer.objects
    assert set(np.unique(seen)) == {0, 1} and (truth.object == 2).all()
    seam = seen[:-1, :-1] != seen[:-1, 1:]
    assert seam.sum() == SIDE - 1
    errors = reprojection_errors(moved_along(truth, 0.01), truth, gbuffer)
    assert len(errors) == (SIDE - 1) ** 2 - seam.sum()


def test_where_neighbouring_rays_meet_an_error_is_infinite(monkeypatch: pytest.MonkeyPatch) -> None:
    truth, gbuffer = mirrored_sheet(45.0)
    monkeypatch.setattr(metrics, "distance_across", lambda o, *_: np.zeros(len(o)))
    off = np.where(np.arange(SIDE * SIDE).reshape(SIDE, SIDE) % 2, 0.01, 0.0)
    errors = reprojection_errors(moved_along(truth, off), truth, gbuffer)
    assert errors.shape == ((SIDE - 1) ** 2,)
    np.testing.assert_array_equal(np.isinf(errors).reshape(SIDE - 1, SIDE - 1), off[:-1, :-1] > 0.0)
    assert (errors[np.isfinite(errors)] == 0.0).all()


def test_no_error_depends_on_the_size_of_the_scene() -> None:
    """Something a thousand times larger far away changes device units, and no figure."""
    alone = mirrored_sheet(45.0)
    far = Object(shape="box", scale=500.0, translate=(0.0, 0.0, -3000.0))
    mirror = Object(shape="plane", material=Material(albedo=(0, 0, 0), mirror=(1, 1, 1)))
    sheet = Object(shape="plane", scale=20.0, rotate=(1, 0, 0, 225.0), translate=(0, 0, CEILING))
    beside = mirrored_sheet(45.0, objects=(mirror, sheet, far))
    assert beside[0].device_units_per_world_unit < 0.1 * alone[0].device_units_per_world_unit
    a, b = (reprojection_errors(moved_along(truth, 0.05), truth, gbuffer) for truth, gbuffer in (alone, beside))
    np.testing.assert_allclose(a, b, rtol=2e-2)


def test_a_pixel_is_the_mean_of_the_ray_to_the_right_and_the_one_below(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays four units apart sideways and nine downwards: six, their geometric mean."""
    truth, gbuffer = mirrored_sheet(45.0)

    def apart(o: np.ndarray, _d: np.ndarray, other: np.ndarray, *_: Any) -> np.ndarray:
        step = np.abs(other - o)
        return np.where(step[:, 0] > step[:, 1], 4.0, 9.0)

    monkeypatch.setattr(metrics, "distance_across", apart)
    errors = reprojection_errors(moved_along(truth, 0.6), truth, gbuffer).reshape(SIDE - 1, SIDE - 1)
    expected = 0.6 * gbuffer.scene.device_units_per_world_unit * 0.5 / 6.0  # sine times cosine of 45 degrees
    assert errors[SIDE // 2, SIDE // 2] == pytest.approx(expected, rel=1e-3)


def test_the_angle_is_that_with_the_turned_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays of the top row meet a sheet that is turned away from them, by their own angle more than on the axis."""
    tilt = 20.0
    truth, gbuffer = mirrored_sheet(tilt)
    monkeypatch.setattr(metrics, "distance_across", lambda o, *_: np.ones(len(o)))
    errors = reprojection_errors(moved_along(truth, 0.1), truth, gbuffer).reshape(SIDE - 1, SIDE - 1)
    ray = np.arctan((1 - 1 / SIDE) * np.tan(np.radians(FIELD / 2)))
    angle = np.radians(tilt) + ray
    expected = 0.1 * gbuffer.scene.device_units_per_world_unit * np.sin(angle) * np.cos(angle)
    assert errors[0, SIDE // 2] == pytest.approx(expected, rel=1e-3)
