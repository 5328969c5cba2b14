"""Errors of places, against errors that are planted and known on paper."""

from typing import Any

import numpy as np
import pytest

from ldtrefl.compare.metrics import reprojection, reprojection_errors
from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Camera, Material, Object, Scene
from tests.compare.metrics.first_hits import first_hits

HEIGHT, CEILING, SIDE, FIELD = 3.0, 5.0, 33, 8.0
"""Of the camera over the mirror, of the sheet over the mirror, pixels along a side, degrees."""


def mirrored_sheet(tilt: float, objects: tuple[Object, ...] | None = None) -> tuple[FirstHits, GBuffer]:
    """Hits and G-buffer of a camera that looks straight down into a flat mirror, which shows a sheet above the camera,
    tilted by ``tilt`` degrees."""
    mirror = Object(shape="plane", scale=1.0, material=Material(albedo=(0, 0, 0), mirror=(1, 1, 1)))
    sheet = Object(shape="plane", scale=20.0, rotate=(1, 0, 0, 180.0 + tilt), translate=(0, 0, CEILING))
    camera = Camera(eye=(0, 0, HEIGHT), look_at=(0, 0, 0), up=(0, 1, 0), width=SIDE, height=SIDE, fov_y=FIELD)
    scene = Scene(camera=camera, objects=objects or (mirror, sheet))
    renderer = Renderer(scene, "bvh")
    frame = renderer.render()
    assert frame.hits is not None and renderer.gbuffer is not None
    return frame.hits, renderer.gbuffer


def moved_along(truth: FirstHits, off: float | np.ndarray) -> FirstHits:
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
    monkeypatch.setattr(reprojection, "distance_across", lambda o, *_: np.zeros(len(o)))
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

    monkeypatch.setattr(reprojection, "distance_across", apart)
    errors = reprojection_errors(moved_along(truth, 0.6), truth, gbuffer).reshape(SIDE - 1, SIDE - 1)
    expected = 0.6 * gbuffer.scene.device_units_per_world_unit * 0.5 / 6.0  # sine times cosine of 45 degrees
    assert errors[SIDE // 2, SIDE // 2] == pytest.approx(expected, rel=1e-3)


def test_the_angle_is_that_with_the_turned_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays of the top row meet a sheet that is turned away from them, by their own angle more than on the axis."""
    tilt = 20.0
    truth, gbuffer = mirrored_sheet(tilt)
    monkeypatch.setattr(reprojection, "distance_across", lambda o, *_: np.ones(len(o)))
    errors = reprojection_errors(moved_along(truth, 0.1), truth, gbuffer).reshape(SIDE - 1, SIDE - 1)
    ray = np.arctan((1 - 1 / SIDE) * np.tan(np.radians(FIELD / 2)))
    angle = np.radians(tilt) + ray
    expected = 0.1 * gbuffer.scene.device_units_per_world_unit * np.sin(angle) * np.cos(angle)
    assert errors[0, SIDE // 2] == pytest.approx(expected, rel=1e-3)
