"""Where the samples of a light stand: a fixed pattern in the unit square, shifted from pixel to pixel by blue noise.

The pattern is a lattice of the golden ratio, even for any number of points; it stays so when it is shifted round the
square's edges (R. Cranley, T. Patterson, "Randomization of number theoretic methods for multiple integration", 1976).
The shift depends on the pixel and the light alone, so pictures have the same bits for any number of threads.
"""

from __future__ import annotations

import warp as wp

GOLDEN = wp.constant(0.6180339887498949)
"""Golden ratio less 1."""

LIGHT_STEP = wp.constant(wp.vec2i(23, 41))
"""Pixels of the mask between the shifts of two lights."""

AXIS_STEP = wp.constant(wp.vec2i(31, 17))
"""Pixels of the mask between the shifts along the square's two sides: far enough that they have nothing in common."""


@wp.func
def shift_in(noise: wp.array2d(dtype=float), column: int, row: int) -> float:
    """A number of the mask, which repeats along both axes."""
    return noise[row % noise.shape[0], column % noise.shape[1]]


@wp.func
def pattern_shift(noise: wp.array2d(dtype=float), pixel: wp.vec2i, number: int) -> wp.vec2:
    """By how much the pattern is shifted in a pixel (column, row); ``number`` tells its patterns apart, from 0 on."""
    column, row = pixel[0] + number * LIGHT_STEP[0], pixel[1] + number * LIGHT_STEP[1]
    return wp.vec2(shift_in(noise, column, row), shift_in(noise, column + AXIS_STEP[0], row + AXIS_STEP[1]))


@wp.func
def pattern_point(k: int, count: int, shift: wp.vec2) -> wp.vec2:
    """Point ``k`` of ``count``, in the unit square."""
    x, y = float(k) / float(count) + shift[0], float(k) * GOLDEN + shift[1]
    return wp.vec2(x - wp.floor(x), y - wp.floor(y))
