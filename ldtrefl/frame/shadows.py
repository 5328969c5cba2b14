"""Shadows: direct light with shadow rays, asked of any tracer."""

from collections.abc import Callable
from typing import Any

import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.shadow_terminator import rise_to_smooth
from ldtrefl.geometry.sphere import sphere_entry
from ldtrefl.geometry.vectors import as_double
from ldtrefl.shading.direct_light import make_shaded
from ldtrefl.shading.surface import Surface
from ldtrefl.tracing.nothing import NOTHING
from ldtrefl.tracing.tracer import Query, Tracer
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.top_level import STACK, TopLevel
from ldtrefl.world.unit_rays import facet_towards, into_unit, start_above, start_above_own, unit_normal


@wp.struct
class ShadowRay:
    """A shadow ray in an object's unit space."""

    query: Query
    outwards: wp.vec3  # as ``Tracer.occluded`` takes it
    rise: wp.vec3  # the way up from the query's origin to where the ray starts; 0 for most


@wp.func
def shadow_ray(record: ObjectRecord, surface: Surface, towards: wp.vec3, distance: float, is_own: bool) -> ShadowRay:
    """The ray that leaves a surface in unit direction ``towards``, to a light at ``distance``, in the unit space of an
    object; ``is_own`` if it is the surface's own."""
    ray = into_unit(record, surface.position, towards)
    outwards = unit_normal(record, surface.facet)
    shadow = ShadowRay()
    shadow.query.direction = ray.direction
    shadow.query.t_max = distance * ray.stretch
    if is_own:
        normal = facet_towards(record, surface.triangle, outwards)
        shadow.query.origin = start_above_own(record, surface.triangle, ray.origin, normal)
        shadow.outwards = outwards
        if record.smooth != 0 and wp.dot(ray.direction, outwards) < 0.0:
            shadow.rise = rise_to_smooth(record, surface.triangle, shadow.query.origin, outwards)
    else:
        shadow.query.origin = start_above(ray.origin, outwards)
    return shadow


@launch.once
def shaded_by(tracer: Tracer, has_looks: bool) -> Callable[..., wp.vec3]:
    """``shaded`` with this tracer's shadows."""
    is_occluded = tracer.occluded

    @wp.func
    def is_in_the_way(views: Any, k: int, shadow: ShadowRay) -> bool:
        query = shadow.query
        height = wp.length(shadow.rise)
        if height > 0.0:
            # The way up must be free, too: else light would leak through what touches the surface.
            query.direction = shadow.rise / height
            query.t_max = height
            if is_occluded(views, k, query, shadow.outwards):
                return True
            query = shadow.query
            query.origin = query.origin + as_double(shadow.rise)
        return is_occluded(views, k, query, shadow.outwards)

    @wp.func
    def is_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> bool:
        nodes = wp.zeros(shape=STACK, dtype=wp.int32)
        nodes[0] = top.root
        waiting = int(1)
        while waiting > 0:
            waiting -= 1
            node = top.nodes[nodes[waiting]]
            for number in range(node.first, node.first + node.count):
                child = top.nodes[number]
                entry = sphere_entry(surface.position, towards, child.centre, child.radius)
                if entry >= 0.0 and entry < distance:
                    if child.count > 0:
                        nodes[waiting] = number
                        waiting += 1
                    else:
                        k = child.first
                        shadow = shadow_ray(objects[k], surface, towards, distance, k == surface.object)
                        if is_in_the_way(views, k, shadow):
                            return False
        return True

    @wp.func
    def always_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> bool:
        return True

    return make_shaded(always_lit if tracer is NOTHING else is_lit, has_looks)
