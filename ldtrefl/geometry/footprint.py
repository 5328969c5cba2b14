"""The footprint of a ray: how the rays of the neighbouring pixels differ from it.

The ray of the next pixel to the right (x), or below (y), starts and points elsewhere. These differences are followed to
first order where the ray goes, and through mirrors (H. Igehy, "Tracing Ray Differentials", 1999; its equations are
named below). How much of a surface a pixel covers, and in which shape, follows from them.

One space throughout; directions and normals have unit length.
"""

from __future__ import annotations

import warp as wp

LEAST_COSINE = wp.constant(0.02)
"""The least cosine between a ray and a facet's normal that a footprint is divided by: one that grazes its facet covers
50 times the width of the ray, and no more."""


@wp.struct
class Footprint:
    """From a ray to those of the pixels to its right and below it: where they are, and where they point."""

    place_x: wp.vec3
    place_y: wp.vec3
    turn_x: wp.vec3
    turn_y: wp.vec3


@wp.func
def place_on_plane(place: wp.vec3, turn: wp.vec3, direction: wp.vec3, t: float, facet: wp.vec3) -> wp.vec3:
    """From where a ray meets a plane, after ``t``, to where a neighbour does (equations 10 and 12). ``facet`` is the
    plane's normal, which faces the ray."""
    apart = place + t * turn
    return apart + (wp.dot(apart, facet) / wp.max(-wp.dot(direction, facet), LEAST_COSINE)) * direction


@wp.func
def footprint_on_plane(footprint: Footprint, direction: wp.vec3, t: float, facet: wp.vec3) -> Footprint:
    """The footprint of a ray where it meets a plane after ``t``."""
    met = Footprint()
    met.place_x = place_on_plane(footprint.place_x, footprint.turn_x, direction, t, facet)
    met.place_y = place_on_plane(footprint.place_y, footprint.turn_y, direction, t, facet)
    met.turn_x = footprint.turn_x
    met.turn_y = footprint.turn_y
    return met


@wp.func
def turn_when_mirrored(
    turn: wp.vec3, direction: wp.vec3, normal: wp.vec3, normal_turn: wp.vec3, leaving: wp.vec3
) -> wp.vec3:
    """From the direction in which a ray leaves a mirror to that of a neighbour (equations 16 and 17); ``normal_turn``
    is from the ray's normal to the neighbour's."""
    cosine = wp.dot(direction, normal)
    change = wp.dot(turn, normal) + wp.dot(direction, normal_turn)
    mirrored = turn - 2.0 * (cosine * normal_turn + change * normal)
    return mirrored - wp.dot(mirrored, leaving) * leaving  # where the normal was bent, too, directions stay unit


@wp.func
def is_same_footprint(a: Footprint, b: Footprint) -> bool:
    """Whether two footprints are equal."""
    return a.place_x == b.place_x and a.place_y == b.place_y and a.turn_x == b.turn_x and a.turn_y == b.turn_y
