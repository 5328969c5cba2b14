"""The footprint of a ray: how the rays of the neighbouring pixels differ from it.

The ray of the next pixel to the right (x), or below (y), starts and points elsewhere. These differences are followed to
first order where the ray goes, and through mirrors (H. Igehy, "Tracing Ray Differentials", 1999; its equations are
named below). How much of a surface a pixel covers, and in which shape, follows from them.

One space throughout; directions and normals have unit length.
"""

from __future__ import annotations

import warp as wp


@wp.struct
class Footprint:
    """From a ray to those of the pixels to its right and below it: where they are, and where they point."""

    place_x: wp.vec3
    place_y: wp.vec3
    turn_x: wp.vec3
    turn_y: wp.vec3


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
