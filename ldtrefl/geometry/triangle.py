"""The normal of a triangle (a, b, c), and its barycentrics: the weights (u, v) of b and c at a point; a has the rest,
1 - u - v.
"""

from __future__ import annotations

import warp as wp

ONE_THIRD = wp.constant(1.0 / 3.0)
"""Both barycentrics of a triangle's centroid."""


@wp.func
def facet_normal(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec3d:
    """The unit normal by the winding, 0 for a triangle without area. In float64: of a slim triangle's cross product
    float32 leaves little."""
    return wp.normalize(wp.cross(b - a, c - a))


@wp.func
def plane_coordinates(a: wp.vec3, b: wp.vec3, c: wp.vec3, p: wp.vec3) -> wp.vec3:
    """Where ``p`` projects to in a triangle's plane, inside or outside: (u, v, squared sine of the angle at a).

    All three are 0 for a triangle without area.
    """
    e, f, g = b - a, c - a, p - a
    ee, ef, ff = wp.dot(e, e), wp.dot(e, f), wp.dot(f, f)
    ge, gf = wp.dot(g, e), wp.dot(g, f)
    determinant = ee * ff - ef * ef
    if determinant <= 0.0:
        return wp.vec3(0.0)
    return wp.vec3((ff * ge - ef * gf) / determinant, (ee * gf - ef * ge) / determinant, determinant / (ee * ff))


@wp.func
def clamped_barycentrics(u: float, v: float) -> wp.vec2:
    """Barycentrics moved into the triangle, for a point that lies outside by rounding."""
    u_inside, v_inside = wp.clamp(u, 0.0, 1.0), wp.clamp(v, 0.0, 1.0)
    excess = wp.max(u_inside + v_inside, 1.0)
    return wp.vec2(u_inside / excess, v_inside / excess)


@wp.func
def barycentrics_at(a: wp.vec3, b: wp.vec3, c: wp.vec3, p: wp.vec3) -> wp.vec2:
    """Barycentrics (u, v) of where ``p`` projects to in a triangle's plane, moved into the triangle."""
    at = plane_coordinates(a, b, c, p)
    return clamped_barycentrics(at[0], at[1])
