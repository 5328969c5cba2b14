"""Where a pixel is sampled, and how much each sample counts in the pixels about it.

Samples lie at fixed places within a pixel, the same in all pixels: the additive sequence of M. Roberts, "The
Unreasonable Effectiveness of Quasirandom Sequences" (2018), which spreads well however many are taken. The first is
the pixel's centre. The image is the mean of the samples, weighted by a Gaussian about the pixel's centre, of standard
deviation 0.375 pixels along each axis, that ends at 1.5 pixels: so a pixel sees samples of its eight neighbours, too.

A pixel has a *level*: it is sampled at its centre alone, or at the first few of all places, or at all of them. Where it
is sampled at few places, each stands for those that are nearest to it.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

STEP = np.array([0.7548776662466927, 0.5698402909980532])
"""1 / p and 1 / p^2, where p is the root of p^3 = p + 1 (Roberts)."""

DEVIATION = 0.375
"""Of the Gaussian, in pixels."""

RADIUS = 1.5
"""Pixels from its middle at which it ends, along each axis."""

FEW = 4
"""Samples that a pixel gets first, if it may have more."""


def places(samples: int) -> np.ndarray:
    """(samples, 2) float64 places within a pixel, right and down from its centre, each from -0.5 to below 0.5."""
    return (0.5 + np.arange(samples)[:, None] * STEP) % 1.0 - 0.5


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
    counts = sorted({1, min(FEW, samples), samples})
    every = places(samples)
    rows = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1), indexing="xy"), axis=-1).reshape(9, 1, 2)
    weights = filter_weight(rows + every)
    weights /= weights.sum()
    return tuple(Level(count, _summed(weights, every, count).astype(np.float32)) for count in counts)


def _summed(weights: np.ndarray, every: np.ndarray, count: int) -> np.ndarray:
    """(9, count): the weights of all places, added up at the nearest of the first ``count``."""
    apart = every[:, None] - every[None, :count]
    nearest = np.square(apart).sum(axis=-1).argmin(axis=1)
    summed = np.zeros((len(weights), count))
    for place, first in enumerate(nearest):
        summed[:, first] += weights[:, place]
    return summed
