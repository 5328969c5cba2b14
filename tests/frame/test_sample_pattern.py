"""Where a pixel is sampled, and how much each sample counts: against the Gaussian's closed form."""

import math

import numpy as np
import pytest

from ldtrefl.frame.sample_pattern import DEVIATION, RADIUS, levels, places


def test_the_first_sample_is_the_centre_and_all_lie_in_the_pixel() -> None:
    found = places(1024)
    assert found[0].tolist() == [0.0, 0.0]
    assert (found >= -0.5).all() and (found < 0.5).all()
    assert len(np.unique(found, axis=0)) == 1024


@pytest.mark.parametrize("count", [16, 64, 256])
def test_samples_are_spread_well(count: int) -> None:
    # Every cell of a grid with a quarter as many cells as there are samples has some.
    side = math.isqrt(count) // 2
    cells = np.floor((places(count) + 0.5) * side).astype(int)
    in_cell = np.bincount(cells[:, 1] * side + cells[:, 0], minlength=side * side)
    assert in_cell.min() >= 2 and in_cell.max() <= 6


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5, 16, 100])
def test_weights_of_all_levels_sum_to_the_same_in_each_pixel(samples: int) -> None:
    found = levels(samples)
    assert [level.samples for level in found] == sorted({1, min(4, samples), samples})
    for level in found:
        assert level.weights.shape == (9, level.samples) and (level.weights >= 0).all()
        np.testing.assert_allclose(level.weights.sum(axis=1), found[0].weights[:, 0], atol=1e-6)
        assert level.weights.sum() == pytest.approx(1.0, abs=1e-6)


def test_weights_are_a_gaussian_that_ends() -> None:
    """Of many samples, a pixel's in its own are the integral of the Gaussian over it."""

    def integral(low: float, high: float) -> float:
        scale = DEVIATION * math.sqrt(2.0)
        whole = 0.5 * DEVIATION * math.sqrt(2.0 * math.pi) * (math.erf(high / scale) - math.erf(low / scale))
        return whole - (high - low) * math.exp(-0.5 * (RADIUS / DEVIATION) ** 2)

    along = np.array([integral(-1.5, -0.5), integral(-0.5, 0.5), integral(0.5, 1.5)])
    expected = np.outer(along, along) / along.sum() ** 2
    np.testing.assert_allclose(levels(1024)[0].weights.reshape(3, 3), expected, atol=2e-3)


def test_a_sample_counts_most_in_the_pixel_that_it_is_nearest_to() -> None:
    weights = levels(64)[-1].weights
    for number, (right, down) in enumerate(places(64)):
        # Row 3 j + i is of the pixel that this one is i - 1 to the right and j - 1 down of.
        by_side = weights[:, number].reshape(3, 3)
        assert (by_side[1, 2] < by_side[1, 0]) == (right > 0) or right == 0.0
        assert (by_side[2, 1] < by_side[0, 1]) == (down > 0) or down == 0.0
