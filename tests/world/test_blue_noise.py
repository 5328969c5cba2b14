"""The mask of blue noise: all numbers once, and next to no energy at low frequencies."""

import numpy as np

from ldtrefl.world.blue_noise import SIDE, blue_noise


def test_every_number_stands_once() -> None:
    mask = blue_noise()
    assert mask.shape == (SIDE, SIDE) and mask.dtype == np.float32
    np.testing.assert_array_equal(np.sort(mask.ravel()), ((np.arange(SIDE**2) + 0.5) / SIDE**2).astype(np.float32))


def test_low_frequencies_are_empty_and_high_ones_alike() -> None:
    """White noise has as much at all of them."""
    mask = blue_noise().astype(float)
    energy = np.abs(np.fft.fft2(mask - mask.mean())) ** 2
    energy /= energy.mean()
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(SIDE), np.fft.fftfreq(SIDE)))
    assert energy[frequency < 0.15].mean() < 0.01
    assert energy[frequency > 0.4].mean() > 1.0


def test_any_share_of_the_numbers_is_spread_evenly() -> None:
    """In each of the mask's 64 blocks of 8 x 8 about as many are below a number."""
    mask = blue_noise()
    for share in (0.1, 0.5, 0.9):
        blocks = (mask < share).reshape(8, 8, 8, 8).mean(axis=(1, 3))
        assert blocks.std() < 0.5 * np.sqrt(share * (1.0 - share)) / 8.0  # of white noise's
