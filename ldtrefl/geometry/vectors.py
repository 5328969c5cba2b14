"""Vectors of float32 and float64 in kernels. Positions that may lie far from 0 are float64, directions are float32."""

from __future__ import annotations

import warp as wp


@wp.func
def as_double(p: wp.vec3) -> wp.vec3d:
    """The same vector in float64."""
    return wp.vec3d(wp.float64(p[0]), wp.float64(p[1]), wp.float64(p[2]))


@wp.func
def as_single(p: wp.vec3d) -> wp.vec3:
    """The nearest vector in float32."""
    return wp.vec3(float(p[0]), float(p[1]), float(p[2]))


@wp.func
def from_to(a: wp.vec3d, b: wp.vec3d) -> wp.vec3:
    """The float32 vector from a to b, subtracted in float64: points far from 0 keep their distance."""
    return wp.vec3(float(b[0] - a[0]), float(b[1] - a[1]), float(b[2] - a[2]))


@wp.func
def point_along(origin: wp.vec3d, direction: wp.vec3, t: float) -> wp.vec3d:
    """``origin + t * direction`` in float64."""
    return origin + wp.float64(t) * as_double(direction)


@wp.func
def low_side(a: wp.vec3d, b: wp.vec3d) -> wp.vec3d:
    """The smaller of each coordinate; of 0 and -0 that of ``b``. ``wp.min`` would call the C library for each."""
    return wp.vec3d(
        wp.where(a[0] < b[0], a[0], b[0]), wp.where(a[1] < b[1], a[1], b[1]), wp.where(a[2] < b[2], a[2], b[2])
    )


@wp.func
def high_side(a: wp.vec3d, b: wp.vec3d) -> wp.vec3d:
    """The larger of each coordinate; of 0 and -0 that of ``b``."""
    return wp.vec3d(
        wp.where(a[0] > b[0], a[0], b[0]), wp.where(a[1] > b[1], a[1], b[1]), wp.where(a[2] > b[2], a[2], b[2])
    )
