"""relMSE: relative mean squared error of radiance (Rousselle, Knaus, Zwicker 2011)."""

from __future__ import annotations

import numpy as np

from ldtrefl.compare.metrics.base import metric

FLOOR = 1e-2
"""Added to the squared reference, as in the paper, so that black pixels do not divide by zero."""


@metric("relmse", heading=None, format=".4f", place=40)
def relmse(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """Relative mean squared error of linear radiance over the mask; 0 is equal. NaN for an empty mask.

    Args:
        image: (h, w, 3) linear radiance.
        reference: (h, w, 3) linear radiance.
        mask: (h, w) bool.
    """
    if not mask.any():
        return float("nan")
    a, b = image[mask].astype(float), reference[mask].astype(float)
    return float(((a - b) ** 2 / (b**2 + FLOOR)).mean())
