"""Distance impostors: exact before planes, to the map's resolution in rooms, and what ends in the environment."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.cube_maps.faces import CubeLayer
from ldtrefl.methods.cube_maps.impostor import distance_to_surface, reflect_distances
from ldtrefl.world.records import LightingRecord
from tests.methods.cube_maps.rooms import (
    CENTRE,
    HIGH,
    LOW,
    RADIUS,
    exits_of_box,
    exits_of_sphere,
    layer_of,
    looked_up,
    random_rays,
    texels,
    unit,
)

RESOLUTION = 128
TEXEL = 2.0 / RESOLUTION


@launch.kernel
def search_distance(
    first: int,
    layer: CubeLayer,
    resolution: int,
    starts: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    reach: float,
    d_out: wp.array(dtype=float),
):
    """Search for one ray."""
    i = first + wp.tid()
    d_out[i] = distance_to_surface(layer.nearness, resolution, starts[i], directions[i], reach)


def searched(distance: np.ndarray, starts: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n,) distances along rays in a map of (6 * RESOLUTION^2,) distances."""
    device = launch.resolve_device(None)
    layer = layer_of(distance, np.zeros((len(distance), 3)), RESOLUTION)
    given = [wp.array(values.astype(np.float32), dtype=wp.vec3, device=device) for values in (starts, directions)]
    found = wp.empty(len(starts), dtype=float, device=device)
    reach = float(distance[distance < np.inf].max())
    launch.launch(search_distance, len(starts), [layer, RESOLUTION, *given, reach, found], device)
    return np.asarray(found.numpy())


def test_in_a_spherical_room_rays_end_on_the_sphere() -> None:
    starts, directions = random_rays(2000)
    found = searched(np.full(6 * RESOLUTION**2, RADIUS), starts, directions)
    np.testing.assert_allclose(found, exits_of_sphere(starts, directions, RADIUS), rtol=5e-3)


def test_in_a_box_rays_end_on_its_walls() -> None:
    """Where two walls meet, a texel shows a corner of its own."""
    starts, directions = random_rays(2000)
    found = searched(exits_of_box(np.zeros(3), unit(texels(RESOLUTION)), LOW, HIGH), starts, directions)
    off = np.abs(found / exits_of_box(starts, directions, LOW, HIGH) - 1.0)
    assert np.quantile(off, 0.9) < 1e-3 and np.quantile(off, 0.99) < 5 * TEXEL


def test_before_a_plane_the_first_guess_is_exact() -> None:
    """A wall that is seen in the directions of the start and of the ray: the step that the paper begins with."""
    starts, directions = np.array([[0.3, 0.1, -0.2]]), unit(np.array([[1.0, 0.3, 0.2]]))
    ways = unit(texels(RESOLUTION))
    with np.errstate(divide="ignore"):
        wall = 1.0 / ways[:, 0]
    found = searched(np.where(wall > 0, wall, np.inf), starts, directions)
    assert found[0] == pytest.approx(0.7 / directions[0, 0], rel=1e-5)


def test_a_start_behind_what_the_map_shows_is_told() -> None:
    starts, directions = random_rays(50)
    assert np.isinf(searched(np.full(6 * RESOLUTION**2, 0.3), starts, directions)).all()


def test_behind_an_edge_is_what_is_seen_beside_it() -> None:
    """A red plate at x = 0.6 before a blue wall at x = 1: rays meet the plate, or the wall behind it."""
    ways = unit(texels(RESOLUTION))
    with np.errstate(divide="ignore"):
        across = np.abs(ways[:, 1:] / ways[:, :1]).max(axis=1)
        plate, wall = 0.6 / ways[:, 0], 1.0 / ways[:, 0]
    is_plate, is_wall = (ways[:, 0] > 0) & (across < 0.5), (ways[:, 0] > 0) & (across < 2.0)
    distance = np.where(is_plate, plate, np.where(is_wall, wall, np.inf))
    layer = layer_of(distance, np.where(is_plate[:, None], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]), RESOLUTION)
    y = np.concatenate([np.linspace(0.0, 0.28, 20), np.linspace(0.32, 0.45, 20)])
    starts, directions = np.stack([np.full(40, 0.1), y, np.zeros(40)], axis=1), np.tile([1.0, 0.0, 0.0], (40, 1))
    inputs = [layer, RESOLUTION, wp.vec3d(*CENTRE), 3.0, LightingRecord()]
    found = looked_up(reflect_distances, starts, directions, *inputs)
    np.testing.assert_allclose(found, np.repeat([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], 20, axis=0), atol=1e-6)


def test_rays_bring_what_the_map_shows_or_the_environment() -> None:
    """Half a spherical room, whose texels hold where they are; above it the environment."""
    lighting = LightingRecord()
    lighting.sky, lighting.ground, lighting.up = wp.vec3(9.0, 8.0, 7.0), wp.vec3(1.0, 2.0, 3.0), wp.vec3(0.0, 0.0, 1.0)
    ways = unit(texels(RESOLUTION))
    layer = layer_of(np.where(ways[:, 2] < 0, RADIUS, np.inf), ways, RESOLUTION)
    starts, directions = random_rays(2000)
    inputs = [layer, RESOLUTION, wp.vec3d(*CENTRE), RADIUS, lighting]
    found = looked_up(reflect_distances, starts, directions, *inputs)
    points = (starts + exits_of_sphere(starts, directions, RADIUS)[:, None] * directions) / RADIUS
    blend = 0.5 + 0.5 * directions[:, 2:]
    expected = np.where(points[:, 2:] < 0, points, blend * [9.0, 8.0, 7.0] + (1.0 - blend) * [1.0, 2.0, 3.0])
    clear = np.abs(points[:, 2]) > 0.25
    off = np.abs(found - expected).max(axis=1)[clear]
    assert clear.sum() > 1000 and np.quantile(off, 0.95) < TEXEL


def test_a_map_of_the_environment_alone_is_not_searched() -> None:
    lighting = LightingRecord()
    lighting.sky = lighting.ground = wp.vec3(1.0, 2.0, 3.0)
    lighting.up = wp.vec3(0.0, 0.0, 1.0)
    layer = layer_of(np.full(6, np.inf), np.zeros((6, 3)), 1)
    found = looked_up(reflect_distances, *random_rays(9), layer, 1, wp.vec3d(*CENTRE), 0.0, lighting)
    np.testing.assert_allclose(found, np.tile([1.0, 2.0, 3.0], (9, 1)), rtol=1e-6)
