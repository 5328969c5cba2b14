"""The sphere and the box about a cube map's centre: closed forms."""

import numpy as np
import pytest

from ldtrefl.methods.cube_maps import surroundings
from ldtrefl.methods.cube_maps.surroundings import Surroundings, reach_of
from tests.methods.cube_maps.rooms import HIGH, LOW, RADIUS, exits_of_box, texels, unit

OWN_LOW, OWN_HIGH = np.full(3, -0.2), np.full(3, 0.2)
"""Of the reflector."""

RESOLUTION = 64


def nearness_of(distance: np.ndarray) -> np.ndarray:
    return (np.linalg.norm(texels(RESOLUTION), axis=1) / distance).astype(np.float32)


def measured(distance: np.ndarray) -> Surroundings:
    return Surroundings.of(nearness_of(distance), RESOLUTION, OWN_LOW, OWN_HIGH)


def test_a_sphere_has_its_radius() -> None:
    assert measured(np.full(6 * RESOLUTION**2, RADIUS)).radius == pytest.approx(RADIUS, rel=1e-6)


def test_half_a_sphere_is_twice_as_far() -> None:
    """Over all directions the mean of 1 / distance is half of what it is over the half that shows something."""
    distance = np.where(texels(RESOLUTION)[:, 2] > 0, RADIUS, np.inf)
    assert measured(distance).radius == pytest.approx(2 * RADIUS, rel=1e-6)


def test_a_texel_counts_by_its_solid_angle() -> None:
    """A cap of half-angle a is (1 - cos a) / 2 of all directions."""
    distance = np.where(unit(texels(RESOLUTION))[:, 0] > 0.5, RADIUS, np.inf)
    assert measured(distance).radius == pytest.approx(4 * RADIUS, rel=0.01)


@pytest.mark.parametrize("together", [surroundings.TEXELS_TOGETHER, 200])
def test_a_room_is_its_box(together: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surroundings, "TEXELS_TOGETHER", together)
    box = measured(exits_of_box(np.zeros(3), unit(texels(RESOLUTION)), LOW, HIGH))
    np.testing.assert_allclose((box.low, box.high), (LOW, HIGH), rtol=1e-6)


def test_what_stands_in_a_room_does_not_move_its_walls() -> None:
    directions = unit(texels(RESOLUTION))
    distance = np.where(directions[:, 1] > 0.95, 0.3, exits_of_box(np.zeros(3), directions, LOW, HIGH))
    box = measured(distance)
    np.testing.assert_allclose((box.low, box.high), (LOW, HIGH), rtol=1e-6)


def test_open_sides_are_infinitely_far() -> None:
    """A floor alone: the sides that no direction to the floor leaves by are open."""
    directions = unit(texels(RESOLUTION))
    with np.errstate(divide="ignore"):
        down = -0.5 / directions[:, 2]
    on_floor = down[:, None] * directions[:, :2]
    distance = np.where((down > 0) & (np.abs(on_floor).max(axis=1) < 2.0), down, np.inf)
    box = measured(distance)
    assert box.low[2] == pytest.approx(-0.5, rel=1e-6) and np.isinf(box.high[2])
    assert min(np.abs([*box.low[:2], *box.high[:2]])) > 5.0


def test_the_environment_alone_has_neither() -> None:
    alone = measured(np.full(6 * RESOLUTION**2, np.inf))
    assert np.isinf([alone.radius, *alone.low, *alone.high]).all() and alone.low[0] < 0 < alone.high[0]
    assert reach_of(np.zeros(6 * RESOLUTION**2, np.float32), RESOLUTION) == 0.0


def test_the_reach_is_the_largest_distance() -> None:
    distance = exits_of_box(np.zeros(3), unit(texels(RESOLUTION)), LOW, HIGH)
    distance[:99] = np.inf
    assert reach_of(nearness_of(distance), RESOLUTION) == pytest.approx(distance[99:].max(), rel=1e-6)
