"""The perspective rasteriser: whether a triangle covers a pixel, and 1 / depth there.

There are two tests. The *planar* one serves triangles whose corners all lie in front of the camera and not far off: it
works in the plane of the image. The *homogeneous* one (Olano and Greer 1997) serves all others: its edge functions come
from the corners' homogeneous pixel coordinates, so triangles that cross the camera's plane need no clipping. Both are
evaluated in float64 and widened by their rounding: neighbours overlap by a hair rather than leave a crack, and the
depth test decides.
"""

from __future__ import annotations

import warp as wp

ROUNDING = wp.constant(wp.float64(1.0e-13))
"""An edge function counts as 0 if it is below this share of its terms: 450 float64 epsilons, for a dozen roundings."""


@wp.struct
class HomogeneousTriangle:
    """Edge functions of a triangle: ``dot(e, (x, y, 1))`` of all three has one sign at the pixels inside."""

    a: wp.vec3d  # of the edge across from corner a
    b: wp.vec3d
    c: wp.vec3d
    volume: wp.float64  # dot(pa, cross(pb, pc)): its sign is the sign inside


@wp.func
def homogeneous_triangle(pa: wp.vec3d, pb: wp.vec3d, pc: wp.vec3d) -> HomogeneousTriangle:
    """Edge functions from corners in homogeneous pixel coordinates (x z, y z, z), where z is the depth."""
    tri = HomogeneousTriangle()
    tri.a = wp.cross(pb, pc)
    tri.b = wp.cross(pc, pa)
    tri.c = wp.cross(pa, pb)
    tri.volume = wp.dot(pa, tri.a)
    return tri


@wp.func
def edge_value(e: wp.vec3d, x: wp.float64, y: wp.float64, sign: wp.float64) -> wp.float64:
    """An edge function at a pixel, times ``sign`` so that it is positive inside; 0 if it is negative by rounding."""
    value = sign * (e[0] * x + e[1] * y + e[2])
    if value < wp.float64(0.0) and value > -ROUNDING * (wp.abs(e[0] * x) + wp.abs(e[1] * y) + wp.abs(e[2])):
        return wp.float64(0.0)
    return value


@wp.func
def perspective_weights(tri: HomogeneousTriangle, x: wp.float64, y: wp.float64) -> wp.vec3d:
    """Weights of the corners at a pixel, not normalised; it is inside if none is negative and their sum is positive."""
    sign = wp.float64(1.0)
    if tri.volume < wp.float64(0.0):
        sign = wp.float64(-1.0)
    return wp.vec3d(edge_value(tri.a, x, y, sign), edge_value(tri.b, x, y, sign), edge_value(tri.c, x, y, sign))


@wp.func
def inverse_depth(tri: HomogeneousTriangle, weights: wp.vec3d) -> float:
    """1 / depth at the pixel of these weights, positive in front of the camera."""
    return float((weights[0] + weights[1] + weights[2]) / wp.abs(tri.volume))


@wp.func
def lowest(a: wp.float64, b: wp.float64, c: wp.float64) -> wp.float64:
    """The least of three numbers. Each comparison is one instruction; ``wp.min`` takes four more to look for NaNs."""
    low = wp.where(a < b, a, b)
    return wp.where(low < c, low, c)


@wp.func
def highest(a: wp.float64, b: wp.float64, c: wp.float64) -> wp.float64:
    """The greatest of three numbers."""
    high = wp.where(a > b, a, b)
    return wp.where(high > c, high, c)


@wp.func
def planar_edge(a: wp.vec3d, b: wp.vec3d, x: wp.float64, y: wp.float64) -> wp.float64:
    """Twice the signed area of the triangle (a, b, pixel) in the image; 0 if it is 0 within rounding."""
    along, across = (b[0] - a[0]) * (y - a[1]), (b[1] - a[1]) * (x - a[0])
    if wp.abs(along - across) < ROUNDING * (wp.abs(along) + wp.abs(across)):
        return wp.float64(0.0)
    return along - across


@wp.func
def planar_nearness(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, x: wp.float64, y: wp.float64) -> float:
    """1 / depth at a pixel, from corners (x, y, 1 / depth) that all lie in front of the camera; 0 outside the triangle,
    which may turn either way."""
    at_a, at_b, at_c = planar_edge(b, c, x, y), planar_edge(c, a, x, y), planar_edge(a, b, x, y)
    zero = wp.float64(0.0)
    area = at_a + at_b + at_c
    if lowest(at_a, at_b, at_c) < zero and highest(at_a, at_b, at_c) > zero:
        return 0.0
    if area == zero:
        return 0.0
    return float((at_a * a[2] + at_b * b[2] + at_c * c[2]) / area)


@wp.func
def planar_covers(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, x: wp.float64, y: wp.float64) -> bool:
    """Whether a triangle that has an area covers a pixel: as ``planar_nearness`` tells."""
    at_a, at_b, at_c = planar_edge(b, c, x, y), planar_edge(c, a, x, y), planar_edge(a, b, x, y)
    return lowest(at_a, at_b, at_c) >= wp.float64(0.0) or highest(at_a, at_b, at_c) <= wp.float64(0.0)
