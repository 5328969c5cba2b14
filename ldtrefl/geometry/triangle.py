"""A triangle's barycentrics: the weights of its second and third corner at a point; the first has the rest."""

from __future__ import annotations

import warp as wp

ONE_THIRD = wp.constant(1.0 / 3.0)
"""Barycentrics of a triangle's centre."""


@wp.func
def plane_coordinates(a: wp.vec3, b: wp.vec3, c: wp.vec3, p: wp.vec3) -> wp.vec3:
    """Weights of b and c at the point of a triangle's plane next to ``p``, whether inside or not, and the squared sine
    of the corner at a; all 0 for a triangle without area."""
    e, f, g = b - a, c - a, p - a
    ee, ef, ff = wp.dot(e, e), wp.dot(e, f), wp.dot(f, f)
    ge, gf = wp.dot(g, e), wp.dot(g, f)
    determinant = ee * ff - ef * ef
    if determinant <= 0.0:
        return wp.vec3(0.0)
    return wp.vec3((ff * ge - ef * gf) / determinant, (ee * gf - ef * ge) / determinant, determinant / (ee * ff))


@wp.func
def brought_inside(u: float, v: float) -> wp.vec2:
    """Barycentrics of the triangle's point next to one that lies outside by rounding."""
    u_inside, v_inside = wp.clamp(u, 0.0, 1.0), wp.clamp(v, 0.0, 1.0)
    excess = wp.max(u_inside + v_inside, 1.0)
    return wp.vec2(u_inside / excess, v_inside / excess)


@wp.func
def barycentrics_at(a: wp.vec3, b: wp.vec3, c: wp.vec3, p: wp.vec3) -> wp.vec2:
    """Weights of b and c at the point of the triangle's plane next to ``p``, brought into the triangle."""
    at = plane_coordinates(a, b, c, p)
    return brought_inside(at[0], at[1])
