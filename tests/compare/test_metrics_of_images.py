"""Metrics of two images: values that are known on paper, tiny images, empty masks."""

import numpy as np
import pytest

from ldtrefl.compare import metrics
from ldtrefl.files.srgb import linear_from_srgb


def noise(h: int = 20, w: int = 30) -> np.ndarray:
    return np.random.default_rng(0).random((h, w, 3)).astype(np.float32)


def test_metrics_of_equal_images_and_of_a_known_error() -> None:
    image, mask = noise(), np.zeros((20, 30), bool)
    mask[5:15, 5:20] = True
    assert metrics.ssim(image, image, mask) == pytest.approx(1.0)
    assert metrics.psnr(image, image, mask) == float("inf")
    assert metrics.flip(image, image, mask) == 0.0
    assert metrics.relmse(image, image, mask) == 0.0
    darker = linear_from_srgb(np.full((20, 30, 3), 0.4, np.float32))
    lighter = linear_from_srgb(np.full((20, 30, 3), 0.5, np.float32))
    assert metrics.psnr(darker, lighter, mask) == pytest.approx(20.0, abs=0.01)
    assert 0 < metrics.flip(darker, lighter, mask) < 1
    outside = np.where(mask[..., None], image, 0).astype(np.float32)
    assert metrics.psnr(outside, image, mask) == float("inf")


def test_metrics_of_tiny_images_and_empty_masks() -> None:
    image = noise(2, 3)
    assert metrics.ssim(image, image, np.ones((2, 3), bool)) == pytest.approx(1.0)
    for metric in (metrics.ssim, metrics.psnr, metrics.flip, metrics.relmse):
        assert np.isnan(metric(image, image, np.zeros((2, 3), bool)))
