"""SSIM, against its formula for flat images."""

import numpy as np
import pytest

from ldtrefl.compare.metrics import ssim
from ldtrefl.files.srgb import linear_from_srgb
from tests.compare.metrics.images import noise


def test_equal_images_and_images_smaller_than_the_window() -> None:
    for image in (noise(), noise(2, 3)):
        assert ssim(image, image, np.ones(image.shape[:2], bool)) == pytest.approx(1.0)


def test_only_the_mask_counts() -> None:
    image, mask = noise(60, 60), np.zeros((60, 60), bool)
    mask[:20] = True
    changed = image.copy()
    changed[40:] = 0.0  # beyond the reach of a window in the mask
    assert ssim(changed, image, mask) == pytest.approx(1.0)
    assert ssim(changed, image, ~mask) < 0.9


def test_two_flat_images_differ_by_their_brightness_alone() -> None:
    """Of flat images x and y SSIM is (2 x y + c) / (x^2 + y^2 + c), c = 0.01^2 (Wang et al., eq. 6)."""
    x, y = 0.4, 0.5
    images = [linear_from_srgb(np.full((20, 20, 3), value, np.float32)) for value in (x, y)]
    expected = (2 * x * y + 1e-4) / (x * x + y * y + 1e-4)
    assert ssim(*images, np.ones((20, 20), bool)) == pytest.approx(expected, rel=1e-4)


def test_an_empty_mask_has_none() -> None:
    assert np.isnan(ssim(noise(), noise(), np.zeros((20, 30), bool)))
