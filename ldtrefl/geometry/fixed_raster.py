"""The orthographic rasteriser: which texels a triangle covers that is projected along an axis, exactly.

Texel (u, v) reaches from u to u + 1 and from v to v + 1, its centre is in the middle. Corners are snapped to fixed
point, and edge functions (Pineda 1988) are evaluated in int64 without rounding. A texel centre on an edge belongs to
one side of it by the top-left rule, as if all centres were shifted by the same infinitesimal step. So triangles that
share an edge neither overlap nor leave a crack, and every texel centre inside the projection of a closed mesh is
covered an even number of times, on any machine.
"""

from __future__ import annotations

import warp as wp

SUBTEXEL_BITS = wp.constant(16)
"""Binary digits after the point of a fixed-point coordinate in texels. They are finer than float32 from 256 on. With
them coordinates up to 4096 texels fit in int32, and their edge functions in int64."""
SUBTEXELS = wp.constant(wp.float64(1 << SUBTEXEL_BITS))
"""Fixed-point steps in a texel."""
TEXEL_OF_SUBTEXEL = wp.constant(0.5**SUBTEXEL_BITS)
"""A fixed-point step in texels."""
TEXEL = wp.constant(wp.int64(1 << SUBTEXEL_BITS))
"""A texel in fixed point."""
HALF_TEXEL = wp.constant(wp.int64(1 << (SUBTEXEL_BITS - 1)))
HALF_TEXEL_32 = wp.constant(1 << (SUBTEXEL_BITS - 1))
"""Half a texel in fixed point, as int64 and as int32."""


@wp.struct
class FixedTriangle:
    """A projected triangle in fixed point, its corners counter-clockwise, and the texels that it may cover."""

    ax: wp.int64
    ay: wp.int64
    bx: wp.int64
    by: wp.int64
    cx: wp.int64
    cy: wp.int64
    area: wp.int64  # twice the area; 0 if no texel centre is covered
    flipped: int  # 1 if corners b and c were exchanged to make it counter-clockwise
    first_u: int  # columns of texels from the first to the last
    last_u: int
    first_v: int  # and rows
    last_v: int


@wp.func
def snap(x: wp.float32) -> wp.int64:
    """The nearest fixed-point number to a coordinate in texels."""
    return wp.int64(wp.floor(wp.float64(x) * SUBTEXELS + wp.float64(0.5)))


@wp.func
def unsnap(x: int) -> float:
    """The coordinate in texels of a fixed-point number."""
    return float(x) * TEXEL_OF_SUBTEXEL


@wp.func
def first_centre(x: int) -> int:
    """The first texel whose centre is not below ``x``, in fixed point."""
    return (x + HALF_TEXEL_32 - 1) >> SUBTEXEL_BITS


@wp.func
def last_centre(x: int) -> int:
    """The last texel whose centre is not above ``x``, in fixed point."""
    return (x - HALF_TEXEL_32) >> SUBTEXEL_BITS


@wp.func
def fixed_triangle(au: int, av: int, bu: int, bv: int, cu: int, cv: int, columns: int, rows: int) -> FixedTriangle:
    """A projected triangle from snapped corners a, b, c, on a map of ``columns`` x ``rows`` texels.

    Its ``area`` is 0 if it certainly covers no texel centre.
    """
    tri = FixedTriangle()
    tri.first_u = wp.max(first_centre(wp.min(au, wp.min(bu, cu))), 0)
    tri.last_u = wp.min(last_centre(wp.max(au, wp.max(bu, cu))), columns - 1)
    tri.first_v = wp.max(first_centre(wp.min(av, wp.min(bv, cv))), 0)
    tri.last_v = wp.min(last_centre(wp.max(av, wp.max(bv, cv))), rows - 1)
    # Most triangles of a dense mesh lie between texel centres and end here.
    if tri.first_u > tri.last_u or tri.first_v > tri.last_v:
        return tri
    ax, ay = wp.int64(au), wp.int64(av)
    bx, by = wp.int64(bu), wp.int64(bv)
    cx, cy = wp.int64(cu), wp.int64(cv)
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    flip = area < wp.int64(0)
    tri.ax = ax
    tri.ay = ay
    tri.bx = wp.where(flip, cx, bx)
    tri.by = wp.where(flip, cy, by)
    tri.cx = wp.where(flip, bx, cx)
    tri.cy = wp.where(flip, by, cy)
    tri.area = wp.abs(area)
    tri.flipped = wp.where(flip, 1, 0)
    return tri


@wp.func
def edge(ax: wp.int64, ay: wp.int64, bx: wp.int64, by: wp.int64, x: wp.int64, y: wp.int64) -> wp.int64:
    """Twice the signed area of (a, b, point): positive left of the edge from a to b."""
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


@wp.func
def is_top_left_edge(ax: wp.int64, ay: wp.int64, bx: wp.int64, by: wp.int64) -> bool:
    """Top-left rule: whether points on the edge from a to b of a counter-clockwise triangle belong to the triangle."""
    return by < ay or (by == ay and bx > ax)


@wp.struct
class Coverage:
    """Edge functions at a texel centre: weights of the corners a, b, c, which add up to the triangle's ``area``."""

    covered: bool
    a: wp.int64
    b: wp.int64
    c: wp.int64


@wp.func
def cover(tri: FixedTriangle, u: int, v: int) -> Coverage:
    """Whether the triangle covers the centre of texel (u, v), and the weights of its corners there."""
    x = wp.int64(u) * TEXEL + HALF_TEXEL
    y = wp.int64(v) * TEXEL + HALF_TEXEL
    at = Coverage()
    zero = wp.int64(0)
    at.a = edge(tri.bx, tri.by, tri.cx, tri.cy, x, y)
    at.b = edge(tri.cx, tri.cy, tri.ax, tri.ay, x, y)
    at.c = edge(tri.ax, tri.ay, tri.bx, tri.by, x, y)
    if at.a < zero or at.b < zero or at.c < zero:
        return at
    if at.a == zero and not is_top_left_edge(tri.bx, tri.by, tri.cx, tri.cy):
        return at
    if at.b == zero and not is_top_left_edge(tri.cx, tri.cy, tri.ax, tri.ay):
        return at
    if at.c == zero and not is_top_left_edge(tri.ax, tri.ay, tri.bx, tri.by):
        return at
    at.covered = True
    return at


@wp.func
def interpolate(tri: FixedTriangle, at: Coverage, a: float, b: float, c: float) -> float:
    """A value at a texel centre, linear over the triangle, from its values at the corners as they were given.

    The result is never outside the range of the three.
    """
    wb = wp.where(tri.flipped != 0, at.c, at.b)
    wc = wp.where(tri.flipped != 0, at.b, at.c)
    area = wp.float64(tri.area)
    return float(
        (wp.float64(at.a) * wp.float64(a) + wp.float64(wb) * wp.float64(b) + wp.float64(wc) * wp.float64(c)) / area
    )
