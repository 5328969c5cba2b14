"""A ray against a sphere, in float64: a small sphere far away is met as surely as a near one.

A direction is a float32 vector of about unit length; what its rounding adds to that length is taken out.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.vectors import as_double


@wp.func
def enters_sphere(origin: wp.vec3d, direction: wp.vec3, centre: wp.vec3d, radius: float, t_max: float) -> bool:
    """Whether a ray enters a sphere before ``t_max``, or begins inside it: as ``sphere_entry`` tells, without its
    root."""
    offset, way = centre - origin, as_double(direction)
    square = wp.float64(radius) * wp.float64(radius)
    if wp.dot(offset, offset) <= square:
        return True
    along = wp.dot(offset, way)
    if along < wp.float64(0.0):
        return False  # the sphere lies behind
    # |offset x way| is the distance of the centre from the ray, in lengths of the direction.
    aside, length_squared = wp.cross(offset, way), wp.dot(way, way)
    half_chord_squared = square * length_squared - wp.dot(aside, aside)
    past = along - wp.float64(t_max) * length_squared
    return half_chord_squared >= wp.float64(0.0) and (past <= wp.float64(0.0) or past * past <= half_chord_squared)


@wp.func
def sphere_entry(origin: wp.vec3d, direction: wp.vec3, centre: wp.vec3d, radius: float) -> float:
    """Where a ray enters a sphere: t, 0 from inside, -1 if it misses it."""
    offset, way = centre - origin, as_double(direction)
    square = wp.float64(radius) * wp.float64(radius)
    along = wp.dot(offset, way)
    if wp.dot(offset, offset) <= square:
        return 0.0
    if along < wp.float64(0.0):
        return -1.0
    aside, length_squared = wp.cross(offset, way), wp.dot(way, way)
    half_chord_squared = square * length_squared - wp.dot(aside, aside)
    if half_chord_squared < wp.float64(0.0):
        return -1.0
    return float((along - wp.sqrt(half_chord_squared)) / length_squared)
