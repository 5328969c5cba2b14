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
from ldtrefl.shading.finish import Finish, finishing
from ldtrefl.shading.highlights import highlights
from ldtrefl.shading.radiance_limit import SMALLEST_SQUARE, at_most_largest
from ldtrefl.shading.soft_light import make_soft_light
from ldtrefl.shading.surface import Surface
from ldtrefl.shading.surfaces import Sighting, coloring
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.shading_features import ShadingFeatures
from ldtrefl.world.top_level import TopLevel


@wp.struct
class ArrivingLight:
    """What a light sends to a point."""

    towards: wp.vec3  # unit, the way to it
    distance: float  # +inf for a directional light
    radiance: wp.vec3  # as if it were a directional light's


@wp.func
def light_at(lighting: LightingRecord, i: int, position: wp.vec3d) -> ArrivingLight:
    """What light ``i`` sends to a point if nothing is between."""
    light = ArrivingLight()
    light.towards = lighting.lights[i].towards
    light.radiance = lighting.lights[i].radiance
    light.distance = wp.inf
    if lighting.lights[i].is_point != 0:
        offset = from_to(position, lighting.lights[i].position)
        distance = wp.length(offset)
        light.distance = distance
        light.towards = wp.normalize(offset)
        light.radiance = at_most_largest(light.radiance / wp.max(distance * distance, SMALLEST_SQUARE))
    return light


def make_direct_radiance(share_lit: Callable[..., float], features: ShadingFeatures) -> Callable[..., wp.vec3]:
    """``direct_radiance(views, objects, top, lighting, looks, surface, finishes, pixel)``: emitted and scattered
    radiance; the first of ``finishes`` counts only if there are looks.

    ``share_lit(views, objects, top, looks, surface, direction, distance)`` answers how much light arrives from unit
    ``direction``, from a light at ``distance``, from 0 to 1; only what looks let through is between. It closes over a
    tracer, so shadows exist once for all tracers.
    """
    with_looks, with_shadows = wp.constant(features.looks), wp.constant(features.shadows)
    with_soft, soft_light = wp.constant(features.soft_light), make_soft_light(share_lit, features)

    @wp.func
    def direct_radiance(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        surface: Surface,
        finishes: wp.array(dtype=Finish),
        pixel: wp.vec2i,
    ) -> wp.vec3:
        scatters = wp.max(surface.albedo) > 0.0
        if with_looks:
            scatters = scatters or objects[surface.object].look >= 0
        if not scatters:  # a mirror, or what only glows: no light is looked for
            return at_most_largest(surface.emission)
        total = lighting.ambient
        shine = wp.vec3(0.0)
        normal = surface.normal
        if with_looks:
            normal = finishes[0].normal
            total = finishes[0].ambient * lighting.ambient
        if with_soft:
            lit = soft_light(views, objects, top, lighting, looks, surface, normal, finishes, pixel)
            total = lit.ambient * total + lit.scattered
            shine = lit.mirrored
        for i in range(lighting.lights.shape[0]):
            light = light_at(lighting, i, surface.position)
            cosine = wp.dot(normal, light.towards)
            if cosine > 0.0:
                share = float(1.0)
                if with_shadows:
                    share = share_lit(views, objects, top, looks, surface, light.towards, light.distance)
                if share > 0.0:
                    radiance = light.radiance
                    if with_looks:
                        radiance = share * light.radiance
                        shine += wp.cw_mul(highlights(finishes, light.towards), radiance)
                    total += cosine * radiance
        leaving = surface.emission + wp.cw_mul(surface.albedo, total)
        if with_looks:
            leaving += shine
        return at_most_largest(leaving)

    return direct_radiance


def make_shaded(share_lit: Callable[..., float], features: ShadingFeatures) -> Callable[..., wp.vec3]:
    """``shaded(views, objects, top, lighting, looks, sightings, lane, surfaces, pixel)``: what ``direct_radiance``
    gives for a lane's surface, of which what its object's colours, or its look, say is set first.

    ``pixel`` is the column and the row in the image whose samples of lights are taken.
    """
    direct_radiance = make_direct_radiance(share_lit, features)
    color_surface, finish_surface = coloring(features.probes), finishing(features.probes)

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
        pixel: wp.vec2i,
    ) -> wp.vec3:
        color_surface(objects, sightings, lane, surfaces)
        no_finishes = wp.array(ptr=wp.uint64(0), shape=(0,), dtype=Finish)
        return direct_radiance(views, objects, top, lighting, looks, surfaces[lane], no_finishes, pixel)

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
        pixel: wp.vec2i,
    ) -> wp.vec3:
        memory = wp.zeros(shape=1, dtype=Finish)
        finishes = wp.array(ptr=memory.ptr, shape=(1,), dtype=Finish)
        if objects[sightings[lane].object].look >= 0:
            finish_surface(objects, looks, lighting, sightings, lane, surfaces, finishes)
        else:
            color_surface(objects, sightings, lane, surfaces)
            finishes[0].ambient = 1.0
            finishes[0].normal = surfaces[lane].normal
        return direct_radiance(views, objects, top, lighting, looks, surfaces[lane], finishes, pixel)

    return shaded_with_looks if features.looks else shaded_without_looks
