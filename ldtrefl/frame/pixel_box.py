"""The box of pixels that a projected triangle may cover, in a band of an image."""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.perspective_raster import highest, lowest

BEHIND = wp.constant(wp.float64(0.0))
"""Depth up to which a point is not in front of the camera."""

EDGE_SLACK = wp.constant(wp.float64(1.0e-6))
"""Pixels by which a triangle's box is widened, for centres that lie on its edge up to rounding."""

GUARD = wp.constant(wp.float64(1 << 20))
"""Triangles whose corners lie in front of the camera and have smaller coordinates than this, in pixels, are drawn by
the planar test; all others by the homogeneous one."""


@wp.struct
class PixelBox:
    """The pixels that a triangle may cover; empty if the first is past the last."""

    first_x: int
    last_x: int
    first_y: int
    last_y: int
    planar: bool  # all corners lie in front of the camera and within the guard


@wp.func
def first_pixel(low: wp.float64) -> int:
    """The first pixel whose centre is not below ``low``, up to rounding; ``low`` within the guard."""
    return int(low + (GUARD + wp.float64(0.5) - EDGE_SLACK)) - int(GUARD)


@wp.func
def last_pixel(high: wp.float64) -> int:
    """The last pixel whose centre is not above ``high``, up to rounding; ``high`` within the guard."""
    return int(high + (GUARD - wp.float64(0.5) + EDGE_SLACK)) - int(GUARD)


@wp.func
def beyond(corner: wp.vec3d, width: int, first_row: int, end_row: int) -> int:
    """The sides of the band that a corner lies beyond, a bit each (the outcode of Cohen and Sutherland)."""
    x, y = corner[0], corner[1]
    depth = wp.where(corner[2] > BEHIND, wp.float64(1.0), corner[2])
    code = wp.where(x < BEHIND, 1, 0) + wp.where(y < depth * wp.float64(first_row), 2, 0)
    code += wp.where(x > depth * wp.float64(width), 4, 0) + wp.where(y > depth * wp.float64(end_row), 8, 0)
    return code


@wp.func
def pixel_box(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, width: int, first_row: int, end_row: int) -> PixelBox:
    """The band's pixels whose centres lie in the box about a projected triangle; all where that has no bounds in the
    view."""
    box = PixelBox()
    box.last_x = -1
    farthest = lowest(a[2], b[2], c[2])
    low_x, high_x = lowest(a[0], b[0], c[0]), highest(a[0], b[0], c[0])
    low_y, high_y = lowest(a[1], b[1], c[1]), highest(a[1], b[1], c[1])
    limit = GUARD - wp.float64(1.0)
    box.planar = farthest > BEHIND and low_x > -limit and low_y > -limit and high_x < limit and high_y < limit
    if box.planar:
        box.first_x = wp.max(first_pixel(low_x), 0)
        box.last_x = wp.min(last_pixel(high_x), width - 1)
        box.first_y = wp.max(first_pixel(low_y), first_row)
        box.last_y = wp.min(last_pixel(high_y), end_row - 1)
    elif highest(a[2], b[2], c[2]) > BEHIND:
        codes = beyond(a, width, first_row, end_row) & beyond(b, width, first_row, end_row)
        if (codes & beyond(c, width, first_row, end_row)) == 0:
            box.last_x = width - 1
            box.first_y = first_row
            box.last_y = end_row - 1
    return box
