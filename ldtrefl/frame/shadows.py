"""Shadows: direct light with shadow rays, asked of any tracer."""

from collections.abc import Callable
from typing import Any

import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.shadow_terminator import rise_to_smooth
from ldtrefl.geometry.sphere import sphere_entry
from ldtrefl.geometry.triangle import ONE_THIRD
from ldtrefl.geometry.vectors import as_double, point_along
from ldtrefl.shading.direct_light import make_shaded
from ldtrefl.shading.finish import coverage_of_part
from ldtrefl.shading.surface import Surface, part_of
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.nothing import NOTHING
from ldtrefl.tracing.tracer import Query, Tracer
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.shading_features import ShadingFeatures
from ldtrefl.world.top_level import STACK, TopLevel
from ldtrefl.world.unit_rays import facet_towards, into_unit, start_above, start_above_own, unit_normal

MOST_LAYERS = wp.constant(64)
"""Surfaces of one object that light passes through, at most: what lies behind as many is dark."""


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


@wp.func
def sees_none_of_own(record: ObjectRecord, surface: Surface, towards: wp.vec3) -> bool:
    """Whether a ray that rises from a surface cannot meet the surface's own object, as that is flat or convex."""
    return ((record.returns >> surface.is_back) & 1) == 0 and wp.dot(towards, surface.facet) > 0.0


@wp.func
def lets_through(objects: wp.array(dtype=ObjectRecord), looks: Looks, k: int) -> bool:
    """Whether light may pass through an object's surface, by the alpha of its look."""
    if objects[k].look < 0:
        return False
    return looks.records[objects[k].look].lets_through != 0


@wp.func
def coverage_at(objects: wp.array(dtype=ObjectRecord), looks: Looks, k: int, hit: Hit) -> float:
    """How much light is stopped where a ray meets an object with a look; in the middle of a triangle that stands for
    others (the linear search's)."""
    u, v = wp.where(hit.u < 0.0, ONE_THIRD, hit.u), wp.where(hit.u < 0.0, ONE_THIRD, hit.v)
    return coverage_of_part(objects, looks, k, part_of(objects, k, hit.triangle), hit.triangle, u, v)


@launch.once
def passing(tracer: Tracer, has_alpha: bool) -> Callable[..., float]:
    """``passed(views, objects, looks, k, shadow)``: the share of light, 0 to 1, that passes object ``k`` along a shadow
    ray. Without ``has_alpha`` no object of the scene lets any through that a ray meets."""
    is_occluded, find_hits = tracer.occluded, tracer.closest_hits

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
    def passed_or_not(
        views: Any, objects: wp.array(dtype=ObjectRecord), looks: Looks, k: int, shadow: ShadowRay
    ) -> float:
        return wp.where(is_in_the_way(views, k, shadow), 0.0, 1.0)

    @wp.func
    def passed_in_part(
        views: Any, objects: wp.array(dtype=ObjectRecord), looks: Looks, k: int, shadow: ShadowRay
    ) -> float:
        if not lets_through(objects, looks, k):
            return passed_or_not(views, objects, looks, k, shadow)
        query_memory, hit_memory = wp.zeros(shape=1, dtype=Query), wp.zeros(shape=1, dtype=Hit)
        queries = wp.array(ptr=query_memory.ptr, shape=(1,), dtype=Query)
        hits = wp.array(ptr=hit_memory.ptr, shape=(1,), dtype=Hit)
        queries[0] = shadow.query
        queries[0].origin = shadow.query.origin + as_double(shadow.rise)
        share = float(1.0)
        layers = int(0)
        while layers < MOST_LAYERS and share > 0.0:
            find_hits(views, k, queries, 1, hits)
            if hits[0].triangle < 0:
                return share
            share = share * (1.0 - coverage_at(objects, looks, k, hits[0]))
            # The ray goes on from the other side of the triangle.
            behind = facet_towards(objects[k], hits[0].triangle, queries[0].direction)
            origin = point_along(queries[0].origin, queries[0].direction, hits[0].t)
            queries[0].origin = start_above_own(objects[k], hits[0].triangle, origin, behind)
            queries[0].t_max = queries[0].t_max - hits[0].t
            layers += 1
        return 0.0

    return passed_in_part if has_alpha else passed_or_not


@launch.once
def shaded_by(tracer: Tracer, features: ShadingFeatures) -> Callable[..., wp.vec3]:
    """``shaded`` with this tracer's shadows and occlusion, for scenes that have these features."""
    passed = passing(tracer, features.dimmed_shadows)

    @wp.func
    def share_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        looks: Looks,
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> float:
        nodes = wp.zeros(shape=STACK, dtype=wp.int32)
        nodes[0] = top.root
        waiting = int(1)
        share = float(1.0)
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
                        is_own = k == surface.object
                        if is_own and sees_none_of_own(objects[k], surface, towards):
                            continue
                        shadow = shadow_ray(objects[k], surface, towards, distance, is_own)
                        share = share * passed(views, objects, looks, k, shadow)
                        if share == 0.0:
                            return share
        return share

    @wp.func
    def always_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        looks: Looks,
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> float:
        return 1.0

    if tracer is NOTHING:
        return make_shaded(always_lit, features.without_rays())
    return make_shaded(share_lit, features)
