"""The pattern of samples: even for any number and any shift, and another one in each pixel."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.shading.light_pattern import pattern_point, pattern_shift
from ldtrefl.world.blue_noise import SIDE, blue_noise


@launch.kernel
def place(
    first: int,
    # In:
    noise: wp.array2d(dtype=float),
    pixels: wp.array(dtype=wp.vec2i),
    number: int,
    count: int,
    # Out:
    points_out: wp.array2d(dtype=wp.vec2),
):
    """Each thread places the points of one pixel."""
    i = first + wp.tid()
    shift = pattern_shift(noise, pixels[i], number)
    for k in range(count):
        points_out[i, k] = pattern_point(k, count, shift)


def placed(pixels: list[tuple[int, int]], count: int, number: int = 0) -> np.ndarray:
    """(pixels, count, 2)."""
    cpu = launch.resolve_device(None)
    found = wp.zeros((len(pixels), count), dtype=wp.vec2, device=cpu)
    given = [wp.array(blue_noise(), dtype=float, device=cpu), wp.array(pixels, dtype=wp.vec2i, device=cpu)]
    launch.launch(place, len(pixels), [*given, number, count, found], cpu)
    return found.numpy()


@pytest.mark.parametrize("count", [16, 37, 1024])
def test_points_are_spread_evenly(count: int) -> None:
    for points in placed([(0, 0), (5, 17), (100, 3)], count):
        assert (points >= 0.0).all() and (points < 1.0).all()
        # Halves and strips of the square have their share, to two points.
        for axis in (0, 1):
            for end in (0.25, 0.5, 0.8):
                assert abs((points[:, axis] < end).sum() - end * count) <= 2
        apart = np.abs(points[:, None] - points[None])
        apart = np.hypot(*np.moveaxis(np.minimum(apart, 1.0 - apart), 2, 0))
        assert apart[~np.eye(count, dtype=bool)].min() > 0.35 / np.sqrt(count)


def test_pixels_and_lights_are_shifted_each_in_its_own_way() -> None:
    pixels = [(column, row) for row in range(SIDE) for column in range(SIDE)]
    first, other = placed(pixels, 1)[:, 0], placed(pixels, 1, number=1)[:, 0]
    assert len(np.unique(first[:, 0])) == SIDE**2
    shifts = np.concatenate([first, other], axis=1)
    assert np.abs(np.corrcoef(shifts.T) - np.eye(4)).max() < 0.1
    np.testing.assert_array_equal(placed([(3, 5)], 4), placed([(3 + SIDE, 5 + 7 * SIDE)], 4))
