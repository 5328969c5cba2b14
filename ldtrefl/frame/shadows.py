"""Shadows: direct light with shadow rays, asked of any tracer."""

from collections.abc import Callable
from typing import Any

import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.sphere import sphere_entry
from ldtrefl.shading.direct_light import make_direct_radiance
from ldtrefl.shading.surface import Surface
from ldtrefl.tracing.nothing import NOTHING
from ldtrefl.tracing.tracer import Query, Tracer
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.unit_rays import into_unit, start_above, start_above_own, unit_normal


@launch.once
def direct_radiance_of(tracer: Tracer) -> Callable[..., wp.vec3]:
    """``direct_radiance`` with this tracer's shadows."""
    is_occluded = tracer.occluded

    @wp.func
    def is_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> bool:
        own = surface.object
        for k in range(objects.shape[0]):
            entry = sphere_entry(surface.position, towards, objects[k].centre, objects[k].radius)
            if entry >= 0.0 and entry < distance:
                ray = into_unit(objects[k], surface.position, towards)
                outwards = unit_normal(objects[k], surface.facet)
                start = start_above(ray.start, outwards)
                if k == own:
                    start = start_above_own(objects[k], surface.triangle, ray.start, outwards)
                else:
                    outwards = wp.vec3(0.0)
                query = Query()
                query.origin = start
                query.direction = ray.way
                query.t_max = distance * ray.stretch
                if is_occluded(views, k, query, outwards):
                    return False
        return True

    @wp.func
    def always_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> bool:
        return True

    return make_direct_radiance(always_lit if tracer is NOTHING else is_lit)
