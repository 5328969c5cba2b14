"""A ray against a sphere. Directions have unit length."""

from __future__ import annotations

import warp as wp


@wp.func
def meets_sphere(origin: wp.vec3, direction: wp.vec3, centre: wp.vec3, radius: float) -> bool:
    """Whether a ray meets a sphere, or begins inside it: the same answer as ``sphere_entry``'s without its root."""
    offset = centre - origin
    along = wp.dot(offset, direction)
    aside = offset - along * direction
    return wp.dot(aside, aside) <= radius * radius and (along >= 0.0 or wp.dot(offset, offset) <= radius * radius)


@wp.func
def sphere_entry(origin: wp.vec3, direction: wp.vec3, centre: wp.vec3, radius: float) -> float:
    """Where a ray enters a sphere: t, 0 from inside, -1 if it misses it."""
    offset = centre - origin
    along = wp.dot(offset, direction)
    aside = offset - along * direction
    half_chord_squared = radius * radius - wp.dot(aside, aside)
    if half_chord_squared < 0.0:
        return -1.0
    half_chord = wp.sqrt(half_chord_squared)
    if along + half_chord < 0.0:
        return -1.0
    return wp.max(along - half_chord, 0.0)
