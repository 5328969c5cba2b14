"""A hit: the point at which a ray meets an object first."""

from __future__ import annotations

import warp as wp


@wp.struct
class Hit:
    """The point at which a ray meets an object first."""

    t: float
    triangle: int
    u: float  # barycentrics: weights of the triangle's second and third corner; -1 if it stands for many
    v: float
    normal: wp.vec3  # of the facet, unit, by the triangle's winding
    steps: int  # nodes, blocks or samples looked at


@wp.func
def no_hit() -> Hit:
    """A miss."""
    hit = Hit()
    hit.t = float(wp.inf)
    hit.triangle = -1
    return hit
