"""Cube maps read on a sphere and on a box: exact in rooms that are such."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.cube_maps.proxies import reflect_box, reflect_sphere
from tests.methods.cube_maps.rooms import (
    CENTRE,
    HIGH,
    LOW,
    RADIUS,
    buffer_of,
    exits_of_box,
    exits_of_sphere,
    looked_up,
    random_rays,
    texels,
)

RESOLUTION = 32
OFF = 1.001 / RESOLUTION
"""Where a face ends, its border goes on: half a texel, whose side is 2 / resolution at depth 1."""


def own_places() -> wp.array:
    """A cube map whose texels hold where they are, at depth 1."""
    return wp.array(texels(RESOLUTION).astype(np.float32), dtype=wp.vec3, device=launch.resolve_device(None))


def at_depth_1(points: np.ndarray) -> np.ndarray:
    return np.asarray(points / np.abs(points).max(axis=1, keepdims=True))


def test_a_sphere_is_left_where_geometry_says() -> None:
    starts, directions = random_rays(2000)
    found = looked_up(reflect_sphere, starts, directions, own_places(), RESOLUTION, wp.vec3d(*CENTRE), RADIUS)
    points = starts + exits_of_sphere(starts, directions, RADIUS)[:, None] * directions
    np.testing.assert_allclose(found, at_depth_1(points), atol=OFF)
    assert np.quantile(np.abs(found - at_depth_1(points)), 0.9) < 1e-5


def test_a_box_is_left_where_geometry_says() -> None:
    starts, directions = random_rays(2000)
    box = [wp.vec3(*LOW), wp.vec3(*HIGH)]
    found = looked_up(reflect_box, starts, directions, own_places(), RESOLUTION, wp.vec3d(*CENTRE), *box)
    points = starts + exits_of_box(starts, directions, LOW, HIGH)[:, None] * directions
    np.testing.assert_allclose(found, at_depth_1(points), atol=OFF)
    assert np.quantile(np.abs(found - at_depth_1(points)), 0.9) < 1e-5


def test_what_is_infinitely_far_is_looked_up_by_direction() -> None:
    """An infinite sphere or box, one that lies beside the ray, and sides that are open."""
    starts, directions = random_rays(200)
    map_inputs = [own_places(), RESOLUTION, wp.vec3d(*CENTRE)]
    for kernel, inputs in (
        (reflect_sphere, [np.inf]),
        (reflect_sphere, [0.1]),
        (reflect_box, [wp.vec3(-np.inf), wp.vec3(np.inf)]),
        (reflect_box, [wp.vec3(5.0), wp.vec3(5.1)]),
    ):
        found = looked_up(kernel, starts, directions, *map_inputs, *inputs)
        np.testing.assert_allclose(found, at_depth_1(directions), atol=OFF)
    up = np.where(directions[:, 2:] > 0, directions, -directions)
    only_floor = [wp.vec3(-np.inf, -np.inf, -1.0), wp.vec3(np.inf)]
    np.testing.assert_allclose(looked_up(reflect_box, starts, up, *map_inputs, *only_floor), at_depth_1(up), atol=OFF)


def test_other_reflectors_are_left_alone() -> None:
    starts, directions = random_rays(3)
    device = launch.resolve_device(None)
    radiance = wp.full(3, 7.0, dtype=wp.vec3, device=device)
    rays = buffer_of(starts, directions)
    cube = [own_places(), RESOLUTION, wp.vec3d(*CENTRE)]
    launch.launch(reflect_sphere, 3, [rays, 1, *cube, RADIUS, radiance], device)
    launch.launch(reflect_box, 3, [rays, 1, *cube, wp.vec3(*LOW), wp.vec3(*HIGH), radiance], device)
    assert (radiance.numpy() == 7.0).all()
