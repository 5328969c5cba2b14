"""The closest hits of a frame's reflected rays: the nearest of what each object's own ray caster finds."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Material, Object, Scene


@pytest.mark.parametrize("objects", [10, 40])
@pytest.mark.parametrize("skip", ["all", "none"])
def test_the_nearest_object_is_met(objects: int, skip: str) -> None:
    """Objects in more than one word of bits, with and without what culls them; none is moved or scaled."""
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
