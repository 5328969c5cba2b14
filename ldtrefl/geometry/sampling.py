"""Points that are spread evenly: over a square, from there over a disc and over directions."""

from __future__ import annotations

import numpy as np
import warp as wp

QUASIRANDOM = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps along a square's axes of a sequence of points that is spread well however many are taken: 1 / p and 1 / p^2 of
the root of p^3 = p + 1 (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018)."""


@wp.func
def on_disc(point: wp.vec2) -> wp.vec2:
    """A point of the unit square on the unit disc, areas kept: P. Shirley, K. Chiu, "A low distortion map between disk
    and square" (1997)."""
    x, y = 2.0 * point[0] - 1.0, 2.0 * point[1] - 1.0
    if x == 0.0 and y == 0.0:
        return wp.vec2(0.0, 0.0)
    radius, angle = x, 0.25 * wp.PI * (y / x)
    if wp.abs(y) >= wp.abs(x):
        radius, angle = y, 0.5 * wp.PI - 0.25 * wp.PI * (x / y)
    return wp.vec2(radius * wp.cos(angle), radius * wp.sin(angle))


@wp.func
def across(axis: wp.vec3) -> wp.vec3:
    """A unit vector at right angles to a unit axis: T. Duff et al., "Building an orthonormal basis, revisited"
    (2017)."""
    sign = wp.where(axis[2] < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + axis[2])
    return wp.vec3(1.0 + sign * axis[0] * axis[0] * a, sign * axis[0] * axis[1] * a, -sign * axis[0])


@wp.func
def about(axis: wp.vec3, x: float, y: float, z: float) -> wp.vec3:
    """The vector whose part along a unit axis is ``z``, and whose parts at right angles are ``x`` and ``y``."""
    side = across(axis)
    return x * side + y * wp.cross(axis, side) + z * axis
