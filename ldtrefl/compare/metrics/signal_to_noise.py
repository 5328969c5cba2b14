"""PSNR: peak signal-to-noise ratio."""

from __future__ import annotations

import numpy as np

from ldtrefl.compare.metrics.base import metric
from ldtrefl.files.srgb import srgb_from_linear


@metric("psnr", heading="PSNR", format=".1f", place=20)
def psnr(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """Peak signal-to-noise ratio of what is shown, in dB; infinite if equal, NaN for an empty mask.

    Args:
        image: (h, w, 3) linear radiance.
        reference: (h, w, 3) linear radiance.
        mask: (h, w) bool.
    """
    if not mask.any():
        return float("nan")
    error = float(((srgb_from_linear(image) - srgb_from_linear(reference))[mask].astype(float) ** 2).mean())
    return float("inf") if error == 0.0 else -10.0 * float(np.log10(error))
