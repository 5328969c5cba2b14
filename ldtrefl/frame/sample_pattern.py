"""Where a pixel is sampled, and how much each sample counts in the pixels about it.

Samples lie at fixed places within a pixel, the same in all pixels: the centre, then three in a triangle about it if
their number is even, then pairs on opposite sides, so that the image is not moved. Pairs are spread by a quasirandom
sequence.

The image is a mean with the weights of a Gaussian about the pixel's centre, of standard deviation 0.375 pixels along
each axis, that ends at 1.5 pixels: so a pixel sees samples of its eight neighbours, too. A sample stands for the part
of its pixel that is nearest to it.

A pixel has a *level*: it is sampled at its centre alone, or at the first few places, or at all of them.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ldtrefl.geometry.sampling import QUASIRANDOM

TRIANGLE_RADIUS, TRIANGLE_ANGLE = 0.38, np.radians(15.0)
"""Of the three samples about the centre: no two of them, nor the centre, lie beside each other along an axis."""

DEVIATION = 0.375
"""Of the Gaussian, in pixels."""

RADIUS = 1.5
"""Pixels from its middle at which it ends, along each axis."""

CELLS = 64
"""Parts of a pixel along each axis by which it is shared out among its samples."""


def places(samples: int) -> np.ndarray:
    """(samples, 2) float64 places within a pixel, right and down from its centre, each from -0.5 to 0.5."""
    angles = TRIANGLE_ANGLE + np.arange(3) * 2.0 * np.pi / 3.0
    triangle = TRIANGLE_RADIUS * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    about = triangle if samples % 2 == 0 else np.empty((0, 2))
    pairs = max(0, -(-(samples - 1 - len(about)) // 2))
    one = (0.5 + np.arange(pairs)[:, None] * QUASIRANDOM) % 1.0 * (0.5, 1.0) - (0.0, 0.5)
    both = np.stack([one, -one], axis=1).reshape(-1, 2)
    return np.concatenate([np.zeros((1, 2)), about, both])[:samples]


def first_few(samples: int) -> int:
    """How many samples a pixel gets first, if it may have so many: those that lie evenly about the centre."""
    return min(4 if samples % 2 == 0 else 5, samples)


def filter_weight(offset: np.ndarray) -> np.ndarray:
    """The Gaussian's weight at offsets (..., 2) in pixels, not normalised."""
    end = np.exp(-0.5 * (RADIUS / DEVIATION) ** 2)
    along = np.maximum(np.exp(-0.5 * (offset / DEVIATION) ** 2) - end, 0.0)
    return np.asarray(along.prod(axis=-1))


@dataclass(frozen=True, eq=False)
class Level:
    """A number of samples."""

    samples: int
    weights: np.ndarray
    """(9, samples) float32: how much each sample counts in each of the pixels about its own. Row ``3 j + i`` is that of
    the pixel for which this one is ``i - 1`` to the right and ``j - 1`` down. All sum to 1."""


@functools.lru_cache(maxsize=8)
def levels(samples: int) -> tuple[Level, ...]:
    """The levels that pixels may have, the fewest samples first; ``samples`` is how many the last one has."""
    every, few = places(samples), first_few(samples)
    along = (np.arange(CELLS) + 0.5) / CELLS - 0.5
    cells = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
    rows = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1)), axis=-1).reshape(9, 1, 2)
    weights = filter_weight(rows + cells)
    weights /= weights.sum()
    found = []
    for count in sorted({1, few, samples}):
        nearest = np.stack([np.square(cells - place).sum(axis=1) for place in every[:count]]).argmin(axis=0)
        shared = np.stack([np.bincount(nearest, row, minlength=count) for row in weights])
        found.append(Level(count, shared.astype(np.float32)))
    return tuple(found)
