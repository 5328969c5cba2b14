"""Reflection regions: runs of rays against brute force in float64, and the pictures."""

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.frame import search_choice
from ldtrefl.frame.regions import cull_runs
from ldtrefl.frame.run_lists import RunLists, listed
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.tracing.object_sets import RUN, entries
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.top_level import order_of, top_level
from tests.frame.random_mirrors import meet, on_device, random_mirrors, reflected

SPHERES = 50
"""Objects that every run of rays is tested against."""


@pytest.mark.parametrize("bend", [0.0, 0.05, 0.5, 3.0])
def test_no_ray_is_lost(bend: float) -> None:
    """100,000 placements of a mirror triangle, its normals, an eye and an object: for 64 rays from the triangle."""
    mirrors = random_mirrors(100_000 // SPHERES // 4, bend)
    origins, directions = reflected(mirrors, int(RUN), flat=False)
    rng = np.random.default_rng(13)
    centre, radius = 3 * rng.normal(size=(SPHERES, 3)), 10.0 ** rng.uniform(-2, 0.3, SPHERES)
    rays = RayBuffer()
    rays.origin = wp.array(origins.reshape(-1, 3), dtype=wp.vec3d, device=launch.resolve_device(None))
    rays.direction = on_device(directions.reshape(-1, 3))
    device, n = rays.origin.device, rays.origin.shape[0]
    rays.source = wp.full(n, SPHERES, dtype=wp.int32, device=device)
    rays.may_return = wp.zeros(n, dtype=wp.uint8, device=device)
    shown, none_shows = wp.zeros(SPHERES, dtype=wp.uint8, device=device), wp.empty(0, dtype=wp.uint8, device=device)
    padded = (radius * (1 + 1e-5)).astype(np.float32)  # as in a scene
    top, nothing = top_level(centre, padded, order_of(centre), device), wp.empty(0, dtype=int, device=device)

    def fill(lists: RunLists, room: int) -> None:
        launch.launch(cull_runs, len(origins), [rays, top, nothing, nothing, room, lists, shown, none_shows], device)

    runs, objects = entries(listed(len(origins), SPHERES, device, fill))
    kept = np.zeros((len(origins), SPHERES), bool)
    kept[runs, objects] = True
    assert len(runs) == kept.sum(), "an object is listed twice"
    np.testing.assert_array_equal(shown.numpy() != 0, kept.any(axis=0))
    truth = np.stack([meet(origins, directions, c, r).any(axis=1) for c, r in zip(centre, radius, strict=True)], 1)
    assert 0.02 < truth.mean() < 0.98
    assert not (truth & ~kept).any(), f"{(truth & ~kept).sum()} of {truth.sum()} lost"
    assert kept.sum() <= 1.01 * truth.sum(), "a run keeps what none of its rays meets"


def two_object_scene(**reflector: object) -> Scene:
    return Scene(
        camera=Camera(eye=(0, -4, 1), look_at=(0, 0, 0), width=160, height=120, fov_y=35),
        objects=(
            Object(shape="sphere", material=Material(mirror=(1, 1, 1)), **reflector),
            Object(shape="torus_knot", params={"segments": [200, 30]}, scale=0.4, translate=(0.9, -1.2, 0)),
        ),
    )


@pytest.mark.parametrize("segments", [[8, 4], [32, 16], [128, 64]])
def test_culling_changes_no_pixel(segments: list[int]) -> None:
    scene = two_object_scene(params={"segments": segments})
    everything = ldtrefl.render(scene, "ldt", skip="none")
    culled = ldtrefl.render(scene, "ldt")
    np.testing.assert_array_equal(culled.image, everything.image)
    counters = culled.stats.counters
    assert counters["searches"] < counters["rays"] / 2 and everything.stats.counters["searches"] == counters["rays"]
    assert counters["searches"] + counters["searches_saved"] == counters["rays"]
    assert 0 < counters["triangles_culled"] < counters["triangles_tested"]


@pytest.mark.parametrize("bounces", [1, 3])
def test_objects_that_nothing_reflects_are_not_peeled(bounces: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search_choice, "FEWEST_TRIANGLES", 10**9)  # nor does the camera need maps
    scene = two_object_scene()
    behind = Object(shape="gyroid", translate=(0, 1.5, -0.375), scale=0.1)  # in the ball's shadow as seen by the eye
    with_more = Scene(camera=scene.camera, objects=(*scene.objects, behind))
    frame = ldtrefl.render(with_more, "ldt", max_bounces=bounces)
    assert frame.stats.counters["objects_peeled"] == 1
    away = scene.with_camera(Camera(eye=(0, -4, 1), look_at=(0, -8, 1), width=32, height=32))
    none = ldtrefl.render(away, "ldt")
    assert none.stats.counters["rays"] == 0 and "objects_peeled" not in none.stats.counters


def test_objects_are_met_nearest_first() -> None:
    """Ten knots in a row before the ball: those behind the first are hardly searched, in whatever order they stand."""
    ball = Object(shape="sphere", material=Material(mirror=(1, 1, 1)))
    knots = [
        Object(shape="box", params={}, scale=0.3, translate=(0.0, -2.0 - 0.7 * i, 0.3 + 0.02 * i)) for i in range(10)
    ]
    camera = Camera(eye=(0, -3, 3), look_at=(0, 0, 0), width=96, height=96, fov_y=45)
    images = []
    for order in (1, -1):
        scene = Scene(camera=camera, objects=(ball, *knots[::order]))
        frame = ldtrefl.render(scene, "ldt")
        unbounded = ldtrefl.render(scene, "ldt", skip="reflection,regions,maps")
        np.testing.assert_array_equal(frame.image, unbounded.image)
        assert frame.stats.counters["searches"] < 0.5 * unbounded.stats.counters["searches"]
        images.append(frame.image)
    np.testing.assert_array_equal(images[0], images[1])
