"""The closest hits of reflected rays over all objects of a scene, for every tracer.

A ray may meet the object that it leaves, too, unless nothing of that object can be seen from its surface
(``scene/convexity.py``). There it starts above the triangle that it leaves; in other objects, which may touch it, where
it is.
"""

from collections.abc import Callable

import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.sphere import meets_sphere, sphere_entry
from ldtrefl.geometry.vectors import as_single
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.object_sets import ObjectSets, has_bit, lowest_bit, object_bits, without
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer, keep_nearer, set_miss
from ldtrefl.tracing.tracer import Query, Tracer
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.unit_rays import facet_towards, into_unit, start_above_own

BEYOND = wp.constant(1.000001)
"""Factor on a ray's nearest distance so far, up to which the next object is searched: a hit in the same place must be
found, too, whatever way it is rounded."""


@wp.func
def objects_to_meet(
    sets: ObjectSets, objects: wp.array(dtype=ObjectRecord), rays: RayBuffer, i: int, word: int
) -> wp.uint32:
    """The objects of a word that ray ``i`` can meet, a bit each: none if it is dead."""
    source = rays.source[i]
    if source < 0:
        return wp.uint32(0)
    bits = object_bits(sets, objects, i, word)
    if source / 32 == word and rays.may_return[i] == wp.uint8(0):
        bits = without(bits, source)
    return bits


@wp.func
def first_entered(
    objects: wp.array(dtype=ObjectRecord), bits: wp.uint32, word: int, origin: wp.vec3d, direction: wp.vec3
) -> int:
    """The object of a word of bits whose bounding sphere a ray enters first; any of them if it enters none."""
    first = 32 * word + lowest_bit(bits)
    rest = without(bits, first)
    if rest == wp.uint32(0):
        return first
    nearest = sphere_entry(origin, direction, objects[first].centre, objects[first].radius)
    while rest != wp.uint32(0):
        k = 32 * word + lowest_bit(rest)
        entry = sphere_entry(origin, direction, objects[k].centre, objects[k].radius)
        if entry >= 0.0 and (entry < nearest or nearest < 0.0):
            nearest = entry
            first = k
        rest = without(rest, k)
    return first


@wp.func
def may_meet(record: ObjectRecord, origin: wp.vec3d, direction: wp.vec3, t_max: float) -> bool:
    """Whether a ray enters the bounding sphere of an object before ``t_max``."""
    if t_max == wp.inf:
        return meets_sphere(origin, direction, record.centre, record.radius)  # needs no root
    entry = sphere_entry(origin, direction, record.centre, record.radius)
    return entry >= 0.0 and entry <= t_max


@wp.struct
class SearchedRay:
    """A ray that is searched for in an object."""

    query: Query
    ray: int  # its number
    stretch: float  # length in the object's unit space of a device unit along it


@launch.once
def searched_of(tracer: Tracer) -> Callable[..., SearchedRay]:
    """``searched_ray(views, objects, k, rays, i, t_max)``: ray ``i`` as it is searched for in object ``k``,
    up to ``t_max``."""
    leaving = tracer.leaving

    @wp.func
    def searched_ray(
        views: wp.array(dtype=tracer.view),
        objects: wp.array(dtype=ObjectRecord),
        k: int,
        rays: RayBuffer,
        i: int,
        t_max: float,
    ) -> SearchedRay:
        ray = into_unit(objects[k], rays.origin[i], rays.direction[i])
        searched = SearchedRay()
        searched.ray = i
        searched.stretch = ray.stretch
        searched.query.origin = ray.origin
        searched.query.direction = ray.direction
        # t stays in device units: divide by the direction's length in unit space.
        searched.query.t_max = t_max * ray.stretch
        if rays.source[i] == k:
            triangle = rays.source_triangle[i]
            searched.query.origin = start_above_own(objects[k], triangle, ray.origin, ray.direction)
            outwards = as_single(facet_towards(objects[k], triangle, ray.direction))
            searched.query = leaving(views, k, searched.query, outwards)
        return searched

    return searched_ray


@wp.func
def keep_found(
    record: ObjectRecord,
    rays: RayBuffer,
    searched: SearchedRay,
    k: int,
    found: Hit,
    in_sphere_only: bool,
    hits: HitBuffer,
):
    """Count a search in object ``k``, and keep what it found if that is nearer than what the ray has met so far. With
    ``in_sphere_only`` a hit counts only if the ray meets the bounding sphere."""
    i = searched.ray
    hits.steps[i] = hits.steps[i] + found.steps
    hits.searches[i] = hits.searches[i] + 1
    is_met = found.triangle >= 0
    if in_sphere_only and is_met:
        # Patches of coarse maps may stick out of the bounding sphere, where a search by bounds does not look.
        is_met = may_meet(record, rays.origin[i], rays.direction[i], wp.inf)
    if is_met:
        keep_nearer(hits, i, k, found.t / searched.stretch, found)


@launch.once
def closest_hits_kernel(tracer: Tracer, block: int, bounds: bool = True) -> wp.Kernel:
    """The kernel that finds where rays end; one item follows ``block`` rays. With ``bounds`` an object is searched only
    for rays that enter its bounding sphere before their nearest hit so far; of 32 the first entered comes first."""
    find_hits, searched_ray = tracer.closest_hits, searched_of(tracer)
    size, to_infinity = wp.constant(block), wp.constant(not bounds)

    @launch.kernel
    def closest_hits(
        first: int,
        # In:
        rays: RayBuffer,
        objects: wp.array(dtype=ObjectRecord),
        views: wp.array(dtype=tracer.view),
        sets: ObjectSets,
        # Out:
        hits: HitBuffer,
    ):
        """Find the closest hits of one block of rays, object by object."""
        begin = size * (first + wp.tid())
        end = wp.min(begin + size, rays.source.shape[0])
        query_memory, hit_memory = wp.zeros(shape=size, dtype=Query), wp.zeros(shape=size, dtype=Hit)
        queries = wp.array(ptr=query_memory.ptr, shape=(size,), dtype=Query)
        found = wp.array(ptr=hit_memory.ptr, shape=(size,), dtype=Hit)
        searched = wp.zeros(shape=size, dtype=SearchedRay)
        to_meet = wp.zeros(shape=size, dtype=wp.uint32)  # of each ray, the objects of a word
        lead = int(-1)  # the first ray that is alive: objects are searched in the order in which it enters them
        for i in range(begin, end):
            set_miss(hits, i)
            if lead < 0 and rays.source[i] >= 0:
                lead = i
        words = wp.where(lead >= 0, (objects.shape[0] + 31) / 32, 0)
        for word in range(words):
            left = wp.uint32(0)
            for i in range(begin, end):
                to_meet[i - begin] = objects_to_meet(sets, objects, rays, i, word)
                left = left | to_meet[i - begin]
            while left != wp.uint32(0):
                k = first_entered(objects, left, word, rays.origin[lead], rays.direction[lead])
                left = without(left, k)

                # Search for the rays that may meet it.
                count = int(0)
                for i in range(begin, end):
                    if has_bit(to_meet[i - begin], k):
                        if to_infinity or may_meet(objects[k], rays.origin[i], rays.direction[i], hits.t[i]):
                            t_max = wp.where(to_infinity, wp.inf, BEYOND * hits.t[i])
                            searched[count] = searched_ray(views, objects, k, rays, i, t_max)
                            queries[count] = searched[count].query
                            count += 1
                if count > 0:
                    find_hits(views, k, queries, count, found)
                for j in range(count):
                    keep_found(objects[k], rays, searched[j], k, found[j], to_infinity, hits)

    return closest_hits
