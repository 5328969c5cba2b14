"""Specular reflection: its direction, and how much light it keeps. All directions have unit length."""

from __future__ import annotations

import warp as wp


@wp.func
def schlick(reflectance: wp.vec3, cosine: float) -> wp.vec3:
    """Schlick's approximation of Fresnel reflectance (1994) from the value at normal incidence."""
    m = 1.0 - wp.clamp(cosine, 0.0, 1.0)
    return reflectance + (wp.vec3(1.0) - reflectance) * (m * m * m * m * m)


@wp.func
def mirror_direction(direction: wp.vec3, normal: wp.vec3) -> wp.vec3:
    """A direction mirrored in the plane that a normal stands on; the normal may point to either side."""
    return wp.normalize(direction - 2.0 * wp.dot(direction, normal) * normal)
