"""Layered distance maps: rooms to the map's resolution, and what only the second layer shows."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.methods.cube_maps.faces import CubeLayer
from ldtrefl.methods.cube_maps.layers import reflect_layers
from ldtrefl.world.records import LightingRecord
from tests.methods.cube_maps.rooms import (
    CENTRE,
    HIGH,
    LOW,
    RADIUS,
    empty_layer,
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
ENVIRONMENT = (7.0, 7.0, 7.0)


def found_by(front: CubeLayer, back: CubeLayer, starts: np.ndarray, directions: np.ndarray, reach: float) -> np.ndarray:
    lighting = LightingRecord()
    lighting.sky = lighting.ground = wp.vec3(*ENVIRONMENT)
    lighting.up = wp.vec3(0.0, 0.0, 1.0)
    inputs = [front, back, RESOLUTION, wp.vec3d(*CENTRE), reach, lighting]
    return looked_up(reflect_layers, starts, directions, *inputs)


@pytest.mark.parametrize("is_behind", [False, True])
@pytest.mark.parametrize("room", ["sphere", "box"])
def test_rays_end_on_the_walls_of_a_room(room: str, is_behind: bool) -> None:
    """Either layer may hold the room; its texels hold where they are."""
    ways = unit(texels(RESOLUTION))
    starts, directions = random_rays(2000)
    if room == "sphere":
        distance, exits = np.full(len(ways), RADIUS), exits_of_sphere(starts, directions, RADIUS)
    else:
        distance = exits_of_box(np.zeros(3), ways, LOW, HIGH)
        exits = exits_of_box(starts, directions, LOW, HIGH)
    walls = layer_of(distance, distance[:, None] * ways, RESOLUTION)
    layers = (empty_layer(RESOLUTION), walls) if is_behind else (walls, empty_layer(RESOLUTION))
    found = found_by(*layers, starts, directions, float(distance.max()))
    off = np.linalg.norm(found - (starts + exits[:, None] * directions), axis=1)
    assert np.quantile(off, 0.9) < 0.2 * TEXEL and np.quantile(off, 0.99) < TEXEL and off.max() < 5 * TEXEL


def plate_before_wall() -> tuple[CubeLayer, CubeLayer]:
    """A red plate at x = 0.6 about the x axis before a blue wall at x = 1; the wall is green where the plate hides it
    from the centre."""
    ways = unit(texels(RESOLUTION))
    with np.errstate(divide="ignore"):
        across = np.abs(ways[:, 1:] / ways[:, :1]).max(axis=1)
        plate, wall = 0.6 / ways[:, 0], 1.0 / ways[:, 0]
    is_plate, is_wall = (ways[:, 0] > 0) & (across < 0.5), (ways[:, 0] > 0) & (across < 2.0)
    front = np.where(is_plate, plate, np.where(is_wall, wall, np.inf))
    colors = np.where(is_plate[:, None], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    back = layer_of(np.where(is_plate, wall, np.inf), np.tile([0.0, 1.0, 0.0], (len(ways), 1)), RESOLUTION)
    return layer_of(front, colors, RESOLUTION), back


def test_rays_pass_beside_a_plate_to_what_it_hides() -> None:
    """Rays along x that start aside pass the plate; those that then turn behind it meet the wall that it hides."""
    y = np.linspace(-0.49, 0.49, 99)
    starts = np.stack([np.full(99, 0.1), y, np.zeros(99)], axis=1)
    found = found_by(*plate_before_wall(), starts, np.tile([1.0, 0.0, 0.0], (99, 1)), 3.0)
    is_plate, is_hidden = np.abs(y) < 0.3, np.abs(y) < 0.5
    assert is_hidden.all()
    clear = np.abs(np.abs(y) - 0.3) > TEXEL
    expected = np.where(is_plate[:, None], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    np.testing.assert_allclose(found[clear & (np.abs(y) < 0.47)], expected[clear & (np.abs(y) < 0.47)], atol=1e-6)


def test_a_ray_that_the_map_loses_sees_what_it_was_before() -> None:
    front = plate_before_wall()[0]
    starts, directions = np.array([[0.1, 0.4, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    lost = found_by(front, empty_layer(RESOLUTION), starts, directions, 3.0)
    np.testing.assert_allclose(lost, [[0.0, 0.0, 1.0]], atol=1e-6)


def test_a_ray_that_comes_out_from_behind_sees_the_environment() -> None:
    ways = unit(texels(RESOLUTION))
    cap = layer_of(np.where(ways[:, 0] > 0.9, 0.5, np.inf), np.zeros((len(ways), 3)), RESOLUTION)
    starts, directions = np.array([[0.6, -0.9, 0.0], [0.3, 0.0, 0.0], [0.0, 0.0, 0.0]]), np.eye(3)[[1, 0, 0]]
    found = found_by(cap, empty_layer(RESOLUTION), starts, directions, 0.5)
    assert found.tolist() == [list(ENVIRONMENT), [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]


def test_maps_of_the_environment_alone_are_not_searched() -> None:
    found = found_by(empty_layer(RESOLUTION), empty_layer(RESOLUTION), *random_rays(9), 0.0)
    np.testing.assert_allclose(found, np.tile(ENVIRONMENT, (9, 1)), rtol=1e-6)
