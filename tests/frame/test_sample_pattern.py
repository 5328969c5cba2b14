"""Where a pixel is sampled, and how much each sample counts: against the Gaussian's closed form."""

import math

import numpy as np
import pytest

from ldtrefl.frame.sample_pattern import DEVIATION, RADIUS, levels, places


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5, 16, 17, 1024])
def test_the_first_sample_is_the_centre_and_all_lie_in_the_pixel(samples: int) -> None:
    found = places(samples)
    assert found.shape == (samples, 2) and found[0].tolist() == [0.0, 0.0]
    assert (np.abs(found) <= 0.5).all()
    assert len(np.unique(found.round(9), axis=0)) == samples


@pytest.mark.parametrize("samples", [64, 256, 1024])
def test_samples_are_spread_well(samples: int) -> None:
    """Every cell of a grid with a quarter as many cells as there are samples has some."""
    side = math.isqrt(samples) // 2
    cells = np.minimum(np.floor((places(samples) + 0.5) * side).astype(int), side - 1)
    in_cell = np.bincount(cells[:, 1] * side + cells[:, 0], minlength=side * side)
    assert in_cell.min() >= 1 and in_cell.max() <= 8


@pytest.mark.parametrize("samples", [1, 3, 4, 5, 6, 16, 17, 100])
def test_the_image_is_not_moved(samples: int) -> None:
    """Of radiance that is linear, the mean is the value at the pixel's centre, whatever levels its neighbours have."""
    rows = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1)), axis=-1).reshape(9, 1, 2)
    for level in levels(samples):
        at = rows + places(samples)[: level.samples]
        moved = (level.weights[..., None] * at).sum(axis=(0, 1))
        assert np.abs(moved).max() < (0.02 if samples % 2 == 0 else 1e-6)


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5, 16, 100])
def test_weights_of_all_levels_sum_to_the_same_in_each_pixel(samples: int) -> None:
    found = levels(samples)
    few = min(samples, 4 if samples % 2 == 0 else 5)
    assert [level.samples for level in found] == sorted({1, few, samples})
    for level in found:
        assert level.weights.shape == (9, level.samples) and (level.weights >= 0).all()
        np.testing.assert_allclose(level.weights.sum(axis=1), found[0].weights[:, 0], atol=1e-6)
        assert level.weights.sum() == pytest.approx(1.0, abs=1e-6)


def test_weights_are_a_gaussian_that_ends() -> None:
    """A whole pixel's are the integrals of the Gaussian over it and its neighbours."""

    def integral(low: float, high: float) -> float:
        scale = DEVIATION * math.sqrt(2.0)
        whole = 0.5 * DEVIATION * math.sqrt(2.0 * math.pi) * (math.erf(high / scale) - math.erf(low / scale))
        return whole - (high - low) * math.exp(-0.5 * (RADIUS / DEVIATION) ** 2)

    along = np.array([integral(-1.5, -0.5), integral(-0.5, 0.5), integral(0.5, 1.5)])
    expected = np.outer(along, along) / along.sum() ** 2
    np.testing.assert_allclose(levels(4)[0].weights.reshape(3, 3), expected, atol=1e-4)


def test_a_sample_counts_most_in_the_pixel_that_it_is_nearest_to() -> None:
    weights = levels(64)[-1].weights
    for number, (right, down) in enumerate(places(64)):
        # Row 3 j + i is of the pixel that this one is i - 1 to the right and j - 1 down of.
        by_side = weights[:, number].reshape(3, 3)
        if abs(right) > 0.1:
            assert (by_side[1, 2] < by_side[1, 0]) == (right > 0)
        if abs(down) > 0.1:
            assert (by_side[2, 1] < by_side[0, 1]) == (down > 0)
