"""SSIM: structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004)."""

from __future__ import annotations

import numpy as np

from ldtrefl.compare.metrics.base import metric
from ldtrefl.files.srgb import srgb_from_linear

WINDOW = 11
"""Pixels along a side of the Gaussian window."""
WINDOW_SIGMA = 1.5
"""Standard deviation of the window, in pixels. It and the window's side are those of the paper."""


@metric("ssim", heading="SSIM", format=".4f", place=10)
def ssim(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """Structural similarity of what is shown, averaged over the mask; 1 is equal. NaN for an empty mask.

    Args:
        image: (h, w, 3) linear radiance.
        reference: (h, w, 3) linear radiance.
        mask: (h, w) bool.
    """
    from skimage.metrics import structural_similarity  # noqa: PLC0415  a fifth of a second

    if not mask.any():
        return float("nan")
    short = [max(0, WINDOW - side) for side in mask.shape]
    padding = ((0, short[0]), (0, short[1]), (0, 0))
    shown, true = (np.pad(srgb_from_linear(x), padding, mode="edge") for x in (image, reference))
    _, values = structural_similarity(
        true,
        shown,
        channel_axis=2,
        data_range=1.0,
        gaussian_weights=True,
        sigma=WINDOW_SIGMA,
        use_sample_covariance=False,
        full=True,
    )
    return float(values[: mask.shape[0], : mask.shape[1]].mean(axis=2)[mask].mean())
