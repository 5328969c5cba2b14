"""Pixels near an edge of a picture: where rounding may tell which of two things is seen."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np


def around(picture: np.ndarray) -> Iterator[np.ndarray]:
    """An (h, w, ...) picture nine times, each pixel in the place of one of the 3 x 3 around it; the border repeats."""
    height, width = picture.shape[:2]
    padded = np.pad(picture, ((1, 1), (1, 1)) + ((0, 0),) * (picture.ndim - 2), mode="edge")
    for row, column in itertools.product(range(3), repeat=2):
        yield padded[row : row + height, column : column + width]


def near_edge(met: np.ndarray) -> np.ndarray:
    """(h, w) bool: the paths of the 3 x 3 pixels around do not all meet the same surfaces in the same order.

    Args:
        met: (h, w, n) numbers of the surfaces that each path meets.
    """
    near: np.ndarray = np.any([(moved != met).any(axis=-1) for moved in around(met)], axis=0)
    return near
