"""Dithering: the mean is right, whole numbers and greys stay, and the same bits come out of parts."""

import numpy as np
import pytest

from ldtrefl.files.dither import SIDE, dithered, thresholds


def test_every_threshold_is_there_once_and_neighbours_are_far_apart() -> None:
    assert np.array_equal(np.sort(thresholds(), axis=None), (np.arange(64) + 0.5) / 64)
    across = np.abs(np.diff(thresholds(), axis=1, append=thresholds()[:, :1]))
    assert across.min() >= 0.25 and not thresholds().flags.writeable


@pytest.mark.parametrize("value", [0.0, 0.1, 0.5, 7.37, 254.9, 255.0])
def test_the_mean_over_the_pattern_is_the_value(value: float) -> None:
    made = dithered(np.full((SIDE, SIDE, 3), value, np.float32))
    assert abs(made.mean() - value) <= 0.5 / 64 + 1e-6
    assert set(np.unique(made)) <= {np.floor(value), np.floor(value) + 1}
    assert np.ptp(made, axis=2).max() == 0, "a grey stays grey"


def test_whole_numbers_stay_as_far_as_float32_has_them() -> None:
    whole = np.arange(256, dtype=np.float32)
    image = np.tile(((whole / 255) * np.float32(255))[None, :, None], (SIDE, 1, 3))
    np.testing.assert_array_equal(dithered(image), np.broadcast_to(whole[None, :, None], image.shape))


def test_parts_of_a_picture_are_those_of_the_whole() -> None:
    image = 20 * np.random.default_rng(0).random((21, 13, 3)).astype(np.float32)
    parts = [dithered(image[:5]), dithered(image[5:16], 5), dithered(image[16:], 16)]
    np.testing.assert_array_equal(np.concatenate(parts), dithered(image))


def test_a_slow_gradient_has_no_bands() -> None:
    """Rounded, its mean over 8 columns is off by up to half a step."""
    ramp = np.tile(np.linspace(10, 12, 800, dtype=np.float32)[None, :, None], (SIDE, 1, 3))

    def worst(made: np.ndarray) -> float:
        return float(np.abs((made - ramp).reshape(SIDE, -1, SIDE, 3).mean(axis=(0, 2))).max())

    assert worst(dithered(ramp)) < 0.03 < 0.45 < worst(np.round(ramp))
