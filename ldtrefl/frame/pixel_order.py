"""The order of pixels whose reflected rays stand together: blocks of 8 x 8.

Rays of a block are alike, so they are culled and searched for together.
"""

from __future__ import annotations

import functools

import numpy as np

BLOCK = 8
"""Pixels along a side of a block; a band of an image is a whole number of them high."""


def pixels_in_blocks(mask: np.ndarray) -> np.ndarray:
    """(n,) int32 numbers of the pixels set in an (h, w) bool mask, block by block of ``BLOCK`` x ``BLOCK``."""
    height, width = mask.shape
    padded = np.pad(mask, ((0, -height % BLOCK), (0, -width % BLOCK)))
    # A row of a block is eight bytes: taken for one number it moves as one.
    rows = padded.view(np.uint64).reshape(-1, BLOCK, padded.shape[1] // BLOCK)
    return _pixels_by_place(height, width)[rows.transpose(0, 2, 1).ravel().view(bool)]


@functools.lru_cache(maxsize=4)
def _pixels_by_place(height: int, width: int) -> np.ndarray:
    """The number of the pixel at each place of the blocks; places beyond the image hold any."""
    rows, columns = -(-height // BLOCK), -(-width // BLOCK)
    y, x = np.mgrid[: rows * BLOCK, : columns * BLOCK].astype(np.int32)
    pixels = (y * width + x).reshape(rows, BLOCK, columns, BLOCK)
    return np.ascontiguousarray(pixels.transpose(0, 2, 1, 3)).ravel()
