"""LDR-FLIP: what one sees of a difference when two images are flipped (Andersson et al. 2020)."""

from __future__ import annotations

import flip_evaluator
import numpy as np

from ldtrefl.compare.metrics.base import metric
from ldtrefl.files.srgb import srgb_from_linear


@metric("flip", heading="FLIP", format=".4f", place=30)
def flip(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """LDR-FLIP of what is shown, at 67 pixels per degree, averaged over the mask; 0 is equal. NaN for an empty mask.

    Args:
        image: (h, w, 3) linear radiance.
        reference: (h, w, 3) linear radiance.
        mask: (h, w) bool.
    """
    if not mask.any():
        return float("nan")
    shown, true = srgb_from_linear(image), srgb_from_linear(reference)
    errors, _, _ = flip_evaluator.evaluate(true, shown, "LDR", applyMagma=False, computeMeanError=False)
    return float(np.asarray(errors).reshape(mask.shape)[mask].mean())
