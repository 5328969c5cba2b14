"""Bilinear interpolation between the pixels of a picture, for every picture that kernels read.

Pixel ``i`` of a row has its centre at coordinate ``i``: a coordinate ``s`` in 0..1 across a picture of ``n`` pixels is
``s * n - 0.5`` here. Along each axis two pixels count, the one before the point and the one after it. Beyond the edge
of the picture an axis either *repeats* (the first pixel follows the last) or is *clamped* (the edge's pixel goes on).

    columns = neighbours_repeating(x, width)
    rows = neighbours_clamped(y, height)
    color = bilinear_blend(
        columns, rows,
        picture[rows.before, columns.before], picture[rows.before, columns.after],
        picture[rows.after, columns.before], picture[rows.after, columns.after],
    )
"""

from __future__ import annotations

import warp as wp


@wp.struct
class Neighbours:
    """The two pixels that count along one axis."""

    before: int  # number of the pixel at or before the point
    after: int  # number of the next one
    weight: float  # of ``after``, from 0 to 1; ``before`` has the rest


@wp.func
def neighbours_repeating(x: float, count: int) -> Neighbours:
    """The neighbours of coordinate ``x``, from -1 to ``count``, among ``count`` pixels that repeat."""
    at = Neighbours()
    start = wp.floor(x)
    # Not by a division: it takes longer than all the rest.
    before = int(start)
    before = wp.where(before < 0, before + count, before)
    at.before = wp.where(before >= count, before - count, before)
    at.after = wp.where(at.before + 1 == count, 0, at.before + 1)
    at.weight = x - start
    return at


@wp.func
def neighbours_clamped(x: float, count: int) -> Neighbours:
    """The neighbours of coordinate ``x`` among ``count`` pixels; beyond the edge both are the edge's pixel."""
    at = Neighbours()
    start = wp.floor(x)
    at.before = wp.clamp(int(start), 0, count - 1)
    at.after = wp.clamp(int(start) + 1, 0, count - 1)
    at.weight = x - start
    return at


@wp.func
def bilinear_blend(
    columns: Neighbours,
    rows: Neighbours,
    upper_left: wp.vec3,
    upper_right: wp.vec3,
    lower_left: wp.vec3,
    lower_right: wp.vec3,
) -> wp.vec3:
    """The mean of four pixels by their weights: along the rows first, then between the rows."""
    upper = (1.0 - columns.weight) * upper_left + columns.weight * upper_right
    lower = (1.0 - columns.weight) * lower_left + columns.weight * lower_right
    return (1.0 - rows.weight) * upper + rows.weight * lower
