"""The closest hits over many objects, against slab tests of boxes in float64."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp
from stress_cases.paths import Surfaces

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.ldt.scene_maps import MapOptions, SceneMaps
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.tracing.closest_hits import closest_hits_kernel
from ldtrefl.tracing.object_sets import ObjectSets, all_sets
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer, empty_hits
from ldtrefl.tracing.scene_bvh import SceneBvh
from ldtrefl.tracing.tracer import SceneTracer, block_of
from ldtrefl.world.device_scene import DeviceScene
from tests.tracing.boxes import HALF, distances, rays_of, scene_of, sets_of_rays

BOXES = 70
"""Three groups, the last one short."""


def found(
    scene: DeviceScene,
    rays: RayBuffer,
    sets: ObjectSets | None = None,
    *,
    bounds: bool = True,
    tracer: SceneTracer | None = None,
) -> HitBuffer:
    """Where rays end, by ray casting if no tracer is given."""
    count = rays.source.shape[0]
    hits, block = empty_hits(count, scene.device), block_of(scene.device)
    bound = (tracer or SceneBvh()).bound(scene, set(range(len(scene.objects))), Stats())
    sets = sets or all_sets(scene.device)
    kernel = closest_hits_kernel(bound.tracer, block, bounds)
    launch.launch(kernel, -(-count // block), [rays, scene.records, bound.views, sets, hits], scene.device)
    return hits


def random_rays(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from outside that cross the region of the boxes."""
    rng = np.random.default_rng(seed)
    origins = rng.normal(size=(count, 3))
    origins *= 8.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-2.5, 2.5, (count, 3)) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.mark.parametrize("bounds", [True, False])
def test_the_nearest_of_many_boxes(bounds: bool) -> None:
    """The object that a ray leaves is not met, and a dead ray meets nothing."""
    places = np.random.default_rng(0).uniform(-2.5, 2.5, (BOXES, 3))
    scene, (origins, directions) = scene_of(places), random_rays(1000, 1)
    t = distances(origins, directions, places)
    source = np.where(np.isfinite(t).any(axis=1), t.argmin(axis=1), 0)
    source[::5] = 13
    source[::7] = -1
    t[np.arange(1000), source] = np.where(source >= 0, np.inf, t[np.arange(1000), source])
    t[source < 0] = np.inf
    nearest, second = np.sort(t, axis=1)[:, :2].T
    # Of two that are entered in one place up to rounding either may be met.
    is_clear = np.isinf(second) | ~np.isclose(second, nearest, rtol=0.0, atol=1e-4)
    expected = np.where(np.isfinite(nearest), t.argmin(axis=1), -1)
    hits = found(scene, rays_of(scene, origins, directions, source), bounds=bounds)
    agrees = hits.object.numpy() == expected
    assert 200 < (expected[is_clear] >= 0).sum() and (agrees | ~is_clear).mean() > 0.998, "all but rays at edges"
    met = agrees & (expected >= 0)
    world_t = hits.t.numpy() / scene.device_units_per_world_unit
    np.testing.assert_allclose(world_t[met], nearest[met], rtol=1e-5)
    assert np.isinf(world_t[expected < 0][agrees[expected < 0]]).all()
    assert (hits.triangle.numpy()[source < 0] == -1).all() and (hits.searches.numpy()[source < 0] == 0).all()
    searches = hits.searches.numpy()[source >= 0]
    assert (searches == BOXES - 1).all() if not bounds else searches.mean() < 0.2 * BOXES


def test_only_objects_of_a_rays_set_are_met() -> None:
    """Four boxes in a row along x; each ray may meet some of them."""
    places = np.array([[x, 0.0, 0.0] for x in (1.0, 2.0, 3.0, 4.0)])
    scene = scene_of(places)
    allowed = [{0, 1, 2, 3}, {1, 3}, {3}, set()]
    origins, directions = np.tile([-1.0, 0.01, 0.02], (4, 1)), np.tile([1.0, 0.0, 0.0], (4, 1))
    sets = sets_of_rays(allowed, scene.device)
    # A ray leaves an object that is not there to be met: the last one, which stands behind all that are met.
    hits = found(scene, rays_of(scene, origins, directions, np.array([3, 0, 0, 0])), sets)
    assert hits.object.numpy().tolist() == [0, 1, 3, -1]
    expected = [2.0 - HALF, 3.0 - HALF, 5.0 - HALF, np.inf]
    np.testing.assert_allclose(hits.t.numpy() / scene.device_units_per_world_unit, expected, rtol=1e-6)
    assert hits.searches.numpy().tolist() == [1, 1, 1, 0], "what is entered first is searched first"


@pytest.mark.parametrize("bounds", [True, False])
def test_of_objects_in_one_place_the_first_is_met(bounds: bool) -> None:
    scene, count = scene_of(np.zeros((5, 3))), 90
    origins, directions = random_rays(count, 2)
    directions = -origins / np.linalg.norm(origins, axis=1, keepdims=True)
    source = np.arange(count) % 5
    hits = found(scene, rays_of(scene, origins, directions, source), bounds=bounds)
    assert hits.object.numpy().tolist() == np.where(source == 0, 1, 0).tolist()


@pytest.mark.parametrize("tracer", ["bvh", "exact", "linear"])
@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_rays_meet_the_object_that_they_leave_where_brute_force_says(tracer: str, size: float) -> None:
    """Half the rays leave a coarse torus to its outside, half to its inside; none meets the triangle that it leaves."""
    mesh, rng, count = shapes.make("torus", {"segments": [24, 12]}), np.random.default_rng(4), 600
    own = rng.integers(0, len(mesh.faces), count)
    corners = mesh.vertices[mesh.faces[own]]
    points = (rng.dirichlet((2, 2, 2), count)[:, :, None] * corners).sum(axis=1)
    ways = rng.normal(size=(count, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    camera = Camera(eye=(0, -9 * size, 0), look_at=(0, 0, 0), width=4, height=4)
    ring = Object(mesh=mesh, scale=size, translate=(2 * size, 0, 0), material=Material(mirror=1.0))
    far = Object(shape="box", scale=0.1 * size, translate=(-40 * size, 0, 0))
    given, starts = Scene(camera=camera, objects=(ring, far)), points * size + [2 * size, 0, 0]
    expected = Surfaces(given).first_hits(starts, ways, own)[0] / size
    assert 300 < np.isfinite(expected).sum() < 580

    scene = DeviceScene(given, launch.resolve_device(None))
    rays = rays_of(scene, starts, ways, np.zeros(count))
    rays.source_triangle = wp.array(own.astype(np.int32), dtype=wp.int32, device=scene.device)
    rays.may_return.fill_(1)
    options = MapOptions(tracer, "balanced", "texel", 8, 256)
    hits = found(scene, rays, tracer=SceneBvh() if tracer == "bvh" else SceneMaps(options))
    t, met = hits.t.numpy() / scene.device_units_per_world_unit / size, np.isfinite(expected)
    if tracer == "linear":  # to a texel, and not what lies nearer than it starts above its surface
        clear = expected > 0.2
        agrees = np.isclose(t, expected, atol=0.03)  # infinity is close to infinity
        assert agrees[clear].mean() > 0.85
        return
    np.testing.assert_array_equal(np.isfinite(t), met)
    np.testing.assert_allclose(t[met], expected[met], rtol=1e-4, atol=1e-4)
    assert (hits.triangle.numpy()[met] != own[met]).all()
    rays.may_return.zero_()
    assert np.isinf(found(scene, rays).t.numpy()).all(), "a ray that cannot come back is not searched for"


@pytest.mark.parametrize("objects", [10, 40])
@pytest.mark.parametrize("skip", ["all", "none"])
def test_rays_of_a_frame_end_where_each_objects_own_caster_says(objects: int, skip: str) -> None:
    """Objects in more than one group, with and without what culls them; none is moved or scaled."""
    rng = np.random.default_rng(0)
    ball = Object(shape="sphere", params={"segments": [24, 12]}, material=Material(mirror=1.0))
    things = []
    for _ in range(objects):
        corners = rng.normal(size=3) * (1.5, 1.0, 1.5) + (0, -2, 0) + 0.7 * rng.normal(size=(5, 3, 3))
        things.append(Object(mesh=ldtrefl.Mesh(corners.reshape(-1, 3), np.arange(15).reshape(-1, 3)), smooth=False))
    camera = Camera(eye=(0, -8, 1), look_at=(0, 0, 0), width=60, height=40, fov_y=30)
    frame = ldtrefl.render(Scene(camera=camera, objects=(ball, *things)), "bvh", skip=skip)
    assert frame.hits is not None
    rays = frame.hits.rays
    pixels = rays.pixel.numpy()
    distance, index = (getattr(frame.hits, name).ravel()[pixels] for name in ("distance", "object"))
    renderer = ldtrefl.Renderer(Scene(camera=camera, objects=(ball, *things)), "bvh")
    renderer.render()
    world_from_device = np.linalg.inv(renderer._device_scene.device_from_world)
    origins = rays.origin.numpy() @ world_from_device[:3, :3].T + world_from_device[:3, 3]
    expected, nearest = np.full(len(pixels), np.inf), np.full(len(pixels), -1)
    for k, thing in enumerate(things, start=1):
        found = ldtrefl.Raycaster(thing.geometry.vertices, thing.geometry.faces).trace(origins, rays.direction.numpy())
        is_nearer = found.t < expected
        expected, nearest = np.where(is_nearer, found.t, expected), np.where(is_nearer, k, nearest)
    assert np.isfinite(expected).sum() > 30
    assert (index != nearest).sum() <= 1  # a ray within rounding of an edge
    same = (index == nearest) & (index > 0)
    np.testing.assert_allclose(distance[same], expected[same], rtol=1e-4)
