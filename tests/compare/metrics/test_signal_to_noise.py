"""PSNR, against known errors."""

import numpy as np
import pytest

from ldtrefl.compare.metrics import psnr
from ldtrefl.files.srgb import linear_from_srgb
from tests.compare.metrics.images import noise


def test_a_known_error() -> None:
    """A difference of 0.1 in what is shown: 20 dB."""
    darker, lighter = (linear_from_srgb(np.full((20, 30, 3), value, np.float32)) for value in (0.4, 0.5))
    assert psnr(darker, lighter, np.ones((20, 30), bool)) == pytest.approx(20.0, abs=0.01)


def test_equal_images_and_differences_outside_the_mask() -> None:
    image, mask = noise(), np.zeros((20, 30), bool)
    mask[5:15, 5:20] = True
    outside = np.where(mask[..., None], image, 0).astype(np.float32)
    assert psnr(image, image, mask) == psnr(outside, image, mask) == float("inf")


def test_an_empty_mask_has_none() -> None:
    assert np.isnan(psnr(noise(), noise(), np.zeros((20, 30), bool)))
