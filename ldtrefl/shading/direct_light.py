"""Direct light: the radiance that a surface emits, and scatters of what lights send.

Outgoing radiance of a surface: ``emission + albedo * texture * (ambient + sum of lights) + mirror * reflected``. The
last term is added elsewhere (``frame/composite.py``). Surfaces with a look (``finish.py``) may get less ambient light,
and mirror lights as microfacets do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import warp as wp

from ldtrefl.geometry.vectors import from_to
from ldtrefl.shading.finish import Finish, finish_surface
from ldtrefl.shading.highlights import highlights
from ldtrefl.shading.surface import Surface
from ldtrefl.shading.surfaces import Sighting, color_surface
from ldtrefl.world.look_records import Looks
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


def make_direct_radiance(share_lit: Callable[..., float], has_looks: bool) -> Callable[..., wp.vec3]:
    """``direct_radiance(views, objects, top, lighting, looks, surface, finishes)``: emitted and scattered radiance; the
    first of ``finishes`` counts only if ``has_looks``.

    ``share_lit(views, objects, top, looks, surface, direction, distance)`` answers how much light arrives from unit
    ``direction``, from a light at ``distance``, from 0 to 1; only what looks let through is between. It closes over a
    tracer, so shadows exist once for all tracers.
    """
    with_looks = wp.constant(has_looks)

    @wp.func
    def direct_radiance(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        surface: Surface,
        finishes: wp.array(dtype=Finish),
    ) -> wp.vec3:
        total = lighting.ambient
        shine = wp.vec3(0.0)
        if with_looks:
            total = finishes[0].ambient * lighting.ambient
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
            if with_looks:
                cosine = wp.dot(finishes[0].normal, towards)
            if cosine > 0.0:
                share = share_lit(views, objects, top, looks, surface, towards, distance)
                if share > 0.0:
                    if with_looks:
                        radiance = share * radiance
                        if lighting.lights[i].is_in_picture == 0:
                            shine += wp.cw_mul(highlights(finishes, towards), radiance)
                    total += cosine * radiance
        light = surface.emission + wp.cw_mul(surface.albedo, total)
        if with_looks:
            light += shine
        return at_most_largest(light)

    return direct_radiance


def make_shaded(share_lit: Callable[..., float], has_looks: bool) -> Callable[..., wp.vec3]:
    """``shaded(views, objects, top, lighting, looks, sightings, lane, surfaces)``: what ``direct_radiance`` gives for
    a lane's surface, of which what its object's colours, or its look, say is set first.

    ``has_looks`` says whether any object of the scene has a look.
    """
    direct_radiance = make_direct_radiance(share_lit, has_looks)

    @wp.func
    def shaded_without_looks(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        sightings: wp.array(dtype=Sighting),
        lane: int,
        surfaces: wp.array(dtype=Surface),
    ) -> wp.vec3:
        color_surface(objects, sightings, lane, surfaces)
        no_finishes = wp.array(ptr=wp.uint64(0), shape=(0,), dtype=Finish)
        return direct_radiance(views, objects, top, lighting, looks, surfaces[lane], no_finishes)

    @wp.func
    def shaded_with_looks(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        sightings: wp.array(dtype=Sighting),
        lane: int,
        surfaces: wp.array(dtype=Surface),
    ) -> wp.vec3:
        memory = wp.zeros(shape=1, dtype=Finish)
        finishes = wp.array(ptr=memory.ptr, shape=(1,), dtype=Finish)
        if objects[sightings[lane].object].look >= 0:
            finish_surface(objects, looks, lighting, sightings, lane, surfaces, finishes)
        else:
            color_surface(objects, sightings, lane, surfaces)
            finishes[0].ambient = 1.0
            finishes[0].normal = surfaces[lane].normal
        return direct_radiance(views, objects, top, lighting, looks, surfaces[lane], finishes)

    return shaded_with_looks if has_looks else shaded_without_looks
