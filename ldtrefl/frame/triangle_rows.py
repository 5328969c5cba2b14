"""Drawing a projected triangle into a z-buffer, row by row.

The key of a pixel holds 1 / depth in its upper half and a number that leads back to the triangle in its lower: the
larger key is nearer.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.atomics import keep_largest
from ldtrefl.frame.pixel_box import BEHIND, GUARD, PixelBox, first_pixel, last_pixel
from ldtrefl.frame.projection import homogeneous
from ldtrefl.geometry.perspective_raster import (
    highest,
    homogeneous_triangle,
    inverse_depth,
    lowest,
    perspective_weights,
    planar_covers,
    planar_edge,
    planar_nearness,
)

WIDE = wp.constant(3)
"""Pixels across a triangle's box from which its rows are cut to what lies between its edges; narrower ones are tested
faster than cut."""

LEAST_AREA = wp.constant(wp.float64(4.0))
"""Twice the area, in square pixels, from which a triangle's rows are cut: rounding cannot change its sign."""

LEAST_RISE = wp.constant(wp.float64(0.25))
"""Rows are cut at edges that rise by more rows than this: where a flatter edge crosses a row is lost in rounding."""

CUT_SLACK = wp.constant(wp.float64(1.0 / 64.0))
"""Pixels by which cut rows are left too long: twice the rounding at an edge ``2 * GUARD`` long that rises by
``LEAST_RISE``."""


ROUNDED_UP = wp.constant(wp.float64(1.0 + 1.0e-9))
"""Factor by which the nearness of a triangle's nearest corner is enlarged: no point of it is nearer than that."""


@wp.struct
class Target:
    """The z-buffer of a band, row by row."""

    keys: wp.array(dtype=wp.int64)  # 0 where nothing is seen
    width: int
    first_row: int
    end_row: int


@wp.struct
class Triangle:
    """A projected triangle."""

    a: wp.vec3d  # its corners, as ``projection.py`` has them
    b: wp.vec3d
    c: wp.vec3d
    number: int  # that leads back to it


@wp.func
def keep_nearest(target: Target, number: int, x: int, y: int, nearness: float):
    """Put a triangle's point into a pixel's key."""
    if nearness > 0.0:
        place = (y - target.first_row) * target.width + x
        upper = wp.int64(wp.cast(nearness, wp.int32)) << wp.int64(32)
        keep_largest(target.keys, place, upper | wp.int64(number))


@wp.func
def nearness_bits(nearness: wp.float64) -> int:
    """The bits of 1 / depth as a key's upper half has them, rounded up: larger is nearer."""
    return wp.cast(wp.float32(nearness * ROUNDED_UP), wp.int32)


@wp.func
def is_behind(target: Target, x: int, y: int, nearest: int) -> bool:
    """Whether a pixel sees something nearer already than a triangle whose nearest point has these bits."""
    key = target.keys[(y - target.first_row) * target.width + x]
    return int(key >> wp.int64(32)) > nearest


@wp.func
def row_bounds(p: wp.vec3d, q: wp.vec3d, area: wp.float64) -> wp.vec4d:
    """The part of row y on the inner side of an edge: from x = ``[0] + [1] y`` to ``[2] + [3] y``. ``area`` is twice
    the triangle's."""
    rise = q[1] - p[1]
    bounds = wp.vec4d(-GUARD, BEHIND, GUARD, BEHIND)
    if wp.abs(rise) > LEAST_RISE:
        slope = (q[0] - p[0]) / rise
        offset = p[0] - slope * p[1]
        if (rise > BEHIND) == (area > BEHIND):
            bounds[2] = offset + CUT_SLACK
            bounds[3] = slope
        else:
            bounds[0] = offset - CUT_SLACK
            bounds[1] = slope
    return bounds


@wp.func
def draw_cut_rows(target: Target, triangle: Triangle, box: PixelBox, first_y: int, last_y: int):
    """Draw a planar triangle's pixels row by row: from the first pixel inside to the last. What lies between two pixels
    inside is inside, and 1 / depth is linear in the image: neither is tested nor interpolated pixel by pixel."""
    half = wp.float64(0.5)
    a, b, c = triangle.a, triangle.b, triangle.c
    nearest = nearness_bits(highest(a[2], b[2], c[2]))
    area = planar_edge(a, b, c[0], c[1])
    across = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area
    down = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area
    ab, bc, ca = row_bounds(a, b, area), row_bounds(b, c, area), row_bounds(c, a, area)
    begin, end = wp.float64(box.first_x), wp.float64(box.last_x) + wp.float64(1.0)
    y = int(first_y)
    while y <= last_y:
        at_y = wp.float64(y) + half
        low = highest(ab[0] + ab[1] * at_y, bc[0] + bc[1] * at_y, ca[0] + ca[1] * at_y)
        high = lowest(ab[2] + ab[3] * at_y, bc[2] + bc[3] * at_y, ca[2] + ca[3] * at_y)
        x = first_pixel(lowest(highest(low, begin, begin), end, end))
        last_x = last_pixel(highest(lowest(high, end, end), begin, begin))
        while x <= last_x and not planar_covers(a, b, c, wp.float64(x) + half, at_y):
            x += 1
        while x < last_x and not planar_covers(a, b, c, wp.float64(last_x) + half, at_y):
            last_x -= 1
        in_row = a[2] + down * (at_y - a[1])
        while x <= last_x:
            if not is_behind(target, x, y, nearest):
                nearness = float(in_row + across * (wp.float64(x) + half - a[0]))
                keep_nearest(target, triangle.number, x, y, nearness)
            x += 1
        y += 1


@wp.func
def draw_rows(target: Target, triangle: Triangle, box: PixelBox, first_y: int, last_y: int):
    """Draw a triangle's pixels from row ``first_y`` to ``last_y``."""
    a, b, c = triangle.a, triangle.b, triangle.c
    half = wp.float64(0.5)
    is_wide = box.planar and box.last_x - box.first_x + 1 >= WIDE
    if is_wide and wp.abs(planar_edge(a, b, c[0], c[1])) > LEAST_AREA:
        draw_cut_rows(target, triangle, box, first_y, last_y)
    elif box.planar:
        nearest = nearness_bits(highest(a[2], b[2], c[2]))
        # Not by ``range``, whose loop tests its step's sign each time: most triangles cover a pixel or two.
        y = int(first_y)
        while y <= last_y:
            x = int(box.first_x)
            while x <= box.last_x:
                if not is_behind(target, x, y, nearest):
                    nearness = planar_nearness(a, b, c, wp.float64(x) + half, wp.float64(y) + half)
                    keep_nearest(target, triangle.number, x, y, nearness)
                x += 1
            y += 1
    else:
        tri = homogeneous_triangle(homogeneous(a), homogeneous(b), homogeneous(c))
        for y in range(first_y, last_y + 1):
            for x in range(box.first_x, box.last_x + 1):
                at = perspective_weights(tri, wp.float64(x) + half, wp.float64(y) + half)
                if wp.min(at) >= BEHIND and tri.volume != BEHIND:
                    keep_nearest(target, triangle.number, x, y, inverse_depth(tri, at))
