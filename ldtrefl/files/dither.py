"""Ordered dithering (B. E. Bayer, 1973): values between two whole numbers become now the one, now the other.

Rounded, a slow gradient shows its steps as bands. Here each pixel has a threshold of its own, from a fixed pattern of
8 x 8, so that the mean over the pattern is right to 1/128 of a step; the same picture always gives the same bits. A
value that is a whole number already, such as black and white, stays so: no threshold is 0 or 1. The three channels of a
pixel share a threshold, so that a grey stays grey. Noise would serve the eye as well, but its files are larger.
"""

from __future__ import annotations

import functools

import numpy as np

SIDE = 8
"""Pixels along a side of the pattern."""


@functools.cache
def thresholds() -> np.ndarray:
    """(8, 8) float32: each of (k + 0.5) / 64 once, neighbours far apart. It is not to be changed."""
    order = np.zeros((1, 1), int)
    while len(order) < SIDE:
        order = np.block([[4 * order, 4 * order + 2], [4 * order + 3, 4 * order + 1]])
    pattern = ((order + 0.5) / order.size).astype(np.float32)
    pattern.flags.writeable = False
    return pattern


def dithered(values: np.ndarray, first_row: int = 0) -> np.ndarray:
    """(h, w, channels) values of 0 or more, each as one of the two whole numbers beside it.

    Args:
        values: in steps of what is written.
        first_row: where the first row stands in its picture.
    """
    rows, columns = np.ogrid[: values.shape[0], : values.shape[1]]
    return np.floor(values + thresholds()[(rows + first_row) % SIDE, columns % SIDE][..., None])
