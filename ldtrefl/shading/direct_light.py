"""Direct light: the radiance that a surface emits, and scatters diffusely of what lights send.

Outgoing radiance of a surface: ``emission + albedo * texture * (ambient + sum of lights) + mirror * reflected``. The
last term is added elsewhere (``frame/composite.py``).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import warp as wp

from ldtrefl.geometry.vectors import from_to
from ldtrefl.shading.surface import Surface
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.top_level import TopLevel

SMALLEST_SQUARE = wp.constant(1.0e-36)
"""The least squared distance that a point light's intensity is divided by: in the surface itself that would be 0."""

LARGEST_RADIANCE = wp.constant(1.0e30)
"""Brighter radiance is cut to this: its sums and products stay finite, and no pixel becomes infinity times 0."""


@wp.func
def at_most_largest(radiance: wp.vec3) -> wp.vec3:
    """Radiance, cut to ``LARGEST_RADIANCE``."""
    return wp.min(radiance, wp.vec3(LARGEST_RADIANCE))


def make_direct_radiance(is_lit: Callable[..., bool]) -> Callable[..., wp.vec3]:
    """``direct_radiance(views, objects, top, lighting, surface)``: emitted and diffusely scattered radiance.

    ``is_lit(views, objects, top, surface, direction, distance)`` answers whether light arrives from unit ``direction``,
    from a light at ``distance``; it closes over a tracer, so shadows exist once for all tracers.
    """

    @wp.func
    def direct_radiance(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        surface: Surface,
    ) -> wp.vec3:
        total = lighting.ambient
        for i in range(lighting.lights.shape[0]):
            towards = lighting.lights[i].towards
            radiance = lighting.lights[i].radiance
            distance = float(wp.inf)
            if lighting.lights[i].is_point != 0:
                offset = from_to(surface.position, lighting.lights[i].position)
                distance = wp.length(offset)
                towards = wp.normalize(offset)
                radiance = at_most_largest(radiance / wp.max(distance * distance, SMALLEST_SQUARE))
            cosine = wp.dot(surface.normal, towards)
            if cosine > 0.0:
                if is_lit(views, objects, top, surface, towards, distance):
                    total += cosine * radiance
        return at_most_largest(surface.emission + wp.cw_mul(surface.albedo, total))

    return direct_radiance
