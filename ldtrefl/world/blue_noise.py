"""A mask of blue noise: by how much the samples of each pixel are shifted against those of its neighbours.

Each number stands far from those that are near it in value, so what a shift does wrong in one pixel its neighbours do
wrong the other way: errors are fine grain, not bands or clumps. The mask repeats without a seam. Made by
void-and-cluster: R. Ulichney, "The void-and-cluster method for dither array generation" (1993); in whole numbers, so
that it is the same everywhere.
"""

from __future__ import annotations

import functools

import numpy as np

from ldtrefl.geometry.sampling import QUASIRANDOM

SIDE = 64
"""Pixels along a side."""

SPREAD = 1.5
"""Pixels: standard deviation of the Gaussian by which clusters and voids are told, as in the paper."""

FIRST = SIDE * SIDE // 10
"""Pixels of the first pattern, of which clusters are taken out."""


@functools.cache
def blue_noise() -> np.ndarray:
    """(SIDE, SIDE) float32, each of the numbers (k + 0.5) / SIDE^2 once."""
    first = _without_clusters(_first_pattern())
    ranks = np.empty(SIDE * SIDE, np.int64)
    pattern, energy = first.copy(), _energy_of(first)
    for rank in range(int(first.sum()) - 1, -1, -1):
        ranks[_take_cluster(pattern, energy)] = rank
    pattern, energy = first.copy(), _energy_of(first)
    for rank in range(int(first.sum()), SIDE * SIDE):
        ranks[_fill_void(pattern, energy)] = rank
    return ((ranks + 0.5) / SIDE**2).astype(np.float32).reshape(SIDE, SIDE)


@functools.cache
def _gaussians() -> np.ndarray:
    """(SIDE, 2 SIDE) int64: a Gaussian about (0, 0), twice side by side, so that all others are cut out of it."""
    away = np.minimum(np.arange(SIDE), SIDE - np.arange(SIDE)) ** 2
    bump = np.round(1e9 * np.exp(-(away[:, None] + away) / (2.0 * SPREAD**2))).astype(np.int64)
    return np.tile(bump, 2)


def _about(pixel: int) -> np.ndarray:
    """(SIDE^2,) int64: a Gaussian about a pixel."""
    row, column = divmod(pixel, SIDE)
    rows = np.roll(_gaussians(), row, axis=0)
    return rows[:, SIDE - column : 2 * SIDE - column].ravel()


def _energy_of(pattern: np.ndarray) -> np.ndarray:
    """(SIDE^2,) int64: the sum of the Gaussians about the pixels of a pattern."""
    energy = np.zeros(SIDE * SIDE, np.int64)
    for pixel in np.flatnonzero(pattern).tolist():
        energy += _about(pixel)
    return energy


def _take_cluster(pattern: np.ndarray, energy: np.ndarray) -> int:
    """Take the pixel out of a pattern that stands closest to others; its number."""
    pixel = int(np.argmax(np.where(pattern, energy, -1)))
    pattern[pixel] = False
    energy -= _about(pixel)
    return pixel


def _fill_void(pattern: np.ndarray, energy: np.ndarray) -> int:
    """Add the pixel to a pattern that stands farthest from others; its number."""
    pixel = int(np.argmin(np.where(pattern, np.iinfo(np.int64).max, energy)))
    pattern[pixel] = True
    energy += _about(pixel)
    return pixel


def _first_pattern() -> np.ndarray:
    """(SIDE^2,) bool."""
    at = (np.arange(FIRST)[:, None] * QUASIRANDOM % 1.0 * SIDE).astype(np.int64)
    pattern = np.zeros(SIDE * SIDE, bool)
    pattern[at[:, 1] * SIDE + at[:, 0]] = True
    return pattern


def _without_clusters(pattern: np.ndarray) -> np.ndarray:
    """The pattern after its pixels have moved from clusters to voids, until one would come back."""
    pattern, energy = pattern.copy(), _energy_of(pattern)
    while True:
        taken = _take_cluster(pattern, energy)
        if _fill_void(pattern, energy) == taken:
            return pattern
