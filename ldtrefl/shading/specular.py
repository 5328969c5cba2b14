"""Specular reflection: its direction, and how much light it keeps. All directions have unit length."""

from __future__ import annotations

import warp as wp

LEAST_RISE = wp.constant(0.01)
"""Sine of the angle above its facet, half a degree, that a mirrored ray has at least, as in Blender's Cycles."""

KEPT_RISE = wp.constant(0.9)
"""Part of the viewer's own rise above the facet that is enough where it is less than ``LEAST_RISE``: what is seen at a
grazing angle mirrors at one. It is less than 1, so that a normal near the facet's stays as it is."""

RISE_ROUNDING = wp.constant(1.0e-6)
"""The least of all rises: several roundings of a float32, so that no ray starts below its facet or along it."""


@wp.func
def schlick(reflectance: wp.vec3, cosine: float) -> wp.vec3:
    """Schlick's approximation of Fresnel reflectance (1994) from the value at normal incidence."""
    m = 1.0 - wp.clamp(cosine, 0.0, 1.0)
    return reflectance + (wp.vec3(1.0) - reflectance) * (m * m * m * m * m)


@wp.func
def mirrored(direction: wp.vec3, normal: wp.vec3) -> wp.vec3:
    """A direction mirrored in the plane that a normal stands on; the normal may point to either side."""
    return wp.normalize(direction - 2.0 * wp.dot(direction, normal) * normal)


@wp.func
def least_rise(direction: wp.vec3, facet: wp.vec3) -> float:
    """The sine of the angle above its facet that a mirrored ray has at least."""
    return wp.max(wp.min(KEPT_RISE * -wp.dot(direction, facet), LEAST_RISE), RISE_ROUNDING)


@wp.func
def bent_direction(direction: wp.vec3, normal: wp.vec3, facet: wp.vec3) -> wp.vec3:
    """A direction mirrored at a normal that is bent to the facet's until the ray rises by ``least_rise``.

    Let V be the way to the viewer, G the facet's normal, and X the unit part of the shading normal across G. A normal
    at an angle a from G, sin(a) X + cos(a) G, mirrors V to a ray whose part along G is::

        V.X sin(2a) + V.G cos(2a) = A cos(2a - p),    A = hypot(V.X, V.G),    p = atan2(V.X, V.G)

    a = 0 gives V.G, which is enough. So 2a may grow to p + acos(least / A).
    """
    to_viewer = -direction
    least = least_rise(direction, facet)
    along = wp.dot(normal, facet)
    across = normal - along * facet
    unit = wp.normalize(across)
    x, z = wp.dot(to_viewer, unit), wp.dot(to_viewer, facet)
    farthest = 0.5 * (wp.atan2(x, z) + wp.acos(wp.min(least / wp.sqrt(x * x + z * z), 1.0)))
    angle = wp.min(wp.atan2(wp.length(across), along), farthest)
    bent = mirrored(direction, wp.normalize(wp.sin(angle) * unit + wp.cos(angle) * facet))
    # What is left is rounding, or a ray that comes along the facet, or whose way is not defined.
    return wp.normalize(bent + wp.max(least - wp.dot(bent, facet), 0.0) * facet)


@wp.func
def mirror_direction(direction: wp.vec3, normal: wp.vec3, facet: wp.vec3) -> wp.vec3:
    """The direction in which a surface mirrors a ray, always above its facet.

    An interpolated normal may mirror a ray into the facet that it leaves, or along it. It is then bent just enough, as
    a continuous function of the normal: the idea of ``ensure_valid_specular_reflection`` in Blender's Cycles.

    Args:
        direction: of the ray that arrives, unit; 0 if the eye touches the surface: the ray then leaves along ``facet``.
        normal: the shading normal, unit.
        facet: the facet's normal, unit, facing the viewer.
    """
    leaving = mirrored(direction, normal)
    rise = wp.dot(leaving, facet)
    if rise < LEAST_RISE:
        if rise < least_rise(direction, facet):
            return bent_direction(direction, normal, facet)
    return leaving
