"""Points of a light's surface, which shadow rays go to; and directions of ambient light."""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.sampling import about, on_disc
from ldtrefl.world.records import RECTANGLE, ShapedLightRecord

BEFORE_LIGHT = wp.constant(0.9999)
"""Part of the way to a light that must be free: a lamp's own glass or plate, where the light is, casts no shadow."""


@wp.struct
class LightSample:
    """A point of a light, as it is seen from a surface."""

    towards: wp.vec3  # unit
    distance: float
    weight: float  # what it counts beside the others; 0 or less below the horizon


@wp.func
def sample_sphere(radius: float, offset: wp.vec3, normal: wp.vec3, point: wp.vec2) -> LightSample:
    """A point of a sphere's visible side, directions spread evenly over the cone that it fills.

    M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering" (2016), 14.2.2. ``point`` is in the unit square.
    """
    distance = wp.length(offset)
    sine_squared = wp.min((radius / distance) * (radius / distance), 1.0)
    disc = on_disc(point)
    # 1 - the cosine of the angle from the middle, which is small where the light is: rounding must not take it away.
    lower = wp.dot(disc, disc) * sine_squared / (1.0 + wp.sqrt(1.0 - sine_squared))
    scale = wp.sqrt(sine_squared / (1.0 + wp.sqrt(1.0 - sine_squared)) * (2.0 - lower))
    sine = scale * wp.length(disc)
    sample = LightSample()
    sample.towards = wp.normalize(about(offset / distance, scale * disc[0], scale * disc[1], 1.0 - lower))
    half_chord = wp.sqrt(wp.max(radius * radius - distance * distance * sine * sine, 0.0))
    sample.distance = wp.max(distance * (1.0 - lower) - half_chord, 0.0)
    sample.weight = wp.dot(normal, sample.towards)
    return sample


@wp.func
def sample_rectangle(light: ShapedLightRecord, offset: wp.vec3, normal: wp.vec3, point: wp.vec2) -> LightSample:
    """A point of a rectangle, spread evenly over it."""
    to_point = offset + (2.0 * point[0] - 1.0) * light.right + (2.0 * point[1] - 1.0) * light.up
    sample = LightSample()
    sample.distance = wp.length(to_point)
    sample.towards = to_point / sample.distance
    sent = wp.max(-wp.dot(sample.towards, light.axis), 0.0) / (sample.distance * sample.distance)
    sample.weight = sent * wp.dot(normal, sample.towards)
    return sample


@wp.func
def sample_light(light: ShapedLightRecord, offset: wp.vec3, normal: wp.vec3, point: wp.vec2) -> LightSample:
    """A point of a light whose middle is at ``offset`` from a surface with this normal."""
    if light.kind == RECTANGLE:
        return sample_rectangle(light, offset, normal, point)
    return sample_sphere(light.radius, offset, normal, point)


@wp.func
def sample_ambient(normal: wp.vec3, distance: float, point: wp.vec2) -> LightSample:
    """A direction from all around, at a distance: as many as there is cosine with the normal."""
    disc = on_disc(point)
    sample = LightSample()
    sample.towards = wp.normalize(about(normal, disc[0], disc[1], wp.sqrt(wp.max(1.0 - wp.dot(disc, disc), 0.0))))
    sample.distance = distance
    sample.weight = 1.0
    return sample
