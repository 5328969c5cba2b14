"""The closest hits of reflected rays over all objects of a scene, for every tracer.

A ray may meet the object that it leaves, too, unless nothing of that object can be seen from its surface
(``scene/convexity.py``). There it starts above the triangle that it leaves; in other objects, which may touch it, where
it is.
"""

from collections.abc import Callable

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit
from ldtrefl.geometry.sphere import meets_sphere, sphere_entry
from ldtrefl.geometry.vectors import as_single
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.object_sets import RUN, ObjectSets, is_listed, object_listed, objects_listed
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer, keep_nearer, set_miss
from ldtrefl.tracing.tracer import Query, Tracer
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.unit_rays import UnitRay, facet_towards, into_unit, start_above_own

BEYOND = wp.constant(1.000001)
"""Factor on a ray's nearest distance so far, up to which the next object is searched: a hit in the same place must be
found, too, whatever way it is rounded."""


GROUP = wp.constant(32)
"""Objects of a run's list that are put in order together: as many as a word has bits."""


@wp.func
def first_entered(
    objects: wp.array(dtype=ObjectRecord),
    sets: ObjectSets,
    run: int,
    begin: int,
    left: wp.uint32,
    origin: wp.vec3d,
    direction: wp.vec3,
) -> int:
    """Of the entries from ``begin`` on of a run's list that are left, a bit each, the one whose object a ray enters
    first, by bounding spheres; any of them if it enters none."""
    first = begin + lowest_bit(wp.uint64(left))
    rest = left & (left - wp.uint32(1))
    nearest = float(-1.0)
    if rest != wp.uint32(0):
        k = object_listed(sets, run, first)
        nearest = sphere_entry(origin, direction, objects[k].centre, objects[k].radius)
    while rest != wp.uint32(0):
        entry = begin + lowest_bit(wp.uint64(rest))
        k = object_listed(sets, run, entry)
        entered = sphere_entry(origin, direction, objects[k].centre, objects[k].radius)
        if entered >= 0.0 and (entered < nearest or nearest < 0.0):
            nearest = entered
            first = entry
        rest = rest & (rest - wp.uint32(1))
    return first


@wp.func
def can_meet(sets: ObjectSets, rays: RayBuffer, run: int, entry: int, k: int, i: int) -> bool:
    """Whether ray ``i`` is alive and can meet object ``k``, which is an entry of its run's list."""
    source = rays.source[i]
    if source < 0 or (source == k and rays.may_return[i] == wp.uint8(0)):
        return False
    return is_listed(sets, run, entry, i)


@wp.func
def may_meet(record: ObjectRecord, origin: wp.vec3d, direction: wp.vec3, t_max: float) -> bool:
    """Whether a ray enters the bounding sphere of an object before ``t_max``."""
    if t_max == wp.inf:
        return meets_sphere(origin, direction, record.centre, record.radius)  # needs no root
    entry = sphere_entry(origin, direction, record.centre, record.radius)
    return entry >= 0.0 and entry <= t_max


@launch.once
def query_of(tracer: Tracer) -> Callable[..., Query]:
    """``query_for(views, objects, k, rays, i, ray, t_max)``: what object ``k`` is asked about ray ``i``, which is
    ``ray`` there, up to ``t_max``."""
    leaving = tracer.leaving

    @wp.func
    def query_for(
        views: wp.array(dtype=tracer.view),
        objects: wp.array(dtype=ObjectRecord),
        k: int,
        rays: RayBuffer,
        i: int,
        ray: UnitRay,
        t_max: float,
    ) -> Query:
        query = Query()
        query.origin = ray.origin
        query.direction = ray.direction
        # t stays in device units: divide by the direction's length in unit space.
        query.t_max = t_max * ray.stretch
        if rays.source[i] == k:
            triangle = rays.source_triangle[i]
            outwards = facet_towards(objects[k], triangle, ray.direction)
            query.origin = start_above_own(objects[k], triangle, ray.origin, outwards)
            query = leaving(views, k, query, as_single(outwards))
        return query

    return query_for


@wp.func
def keep_found(
    record: ObjectRecord,
    rays: RayBuffer,
    i: int,
    k: int,
    stretch: float,
    found: Hit,
    in_sphere_only: bool,
    hits: HitBuffer,
):
    """Count a search for ray ``i`` in object ``k``, where a device unit along it has a length of ``stretch``, and keep
    what it found if that is nearer than what the ray has met so far. With ``in_sphere_only`` a hit counts only if the
    ray meets the bounding sphere."""
    hits.steps[i] = hits.steps[i] + found.steps
    hits.searches[i] = hits.searches[i] + 1
    is_met = found.triangle >= 0
    if in_sphere_only and is_met:
        # Patches of coarse maps may stick out of the bounding sphere, where a search by bounds does not look.
        is_met = may_meet(record, rays.origin[i], rays.direction[i], wp.inf)
    if is_met:
        keep_nearer(hits, i, k, found.t / stretch, found)


@launch.once
def closest_hits_kernel(tracer: Tracer, block: int, bounds: bool = True) -> wp.Kernel:
    """The kernel that finds where rays end; one item follows ``block`` rays. With ``bounds`` an object is searched only
    for rays that enter its sphere before their nearest hit so far; of a group the first entered comes first."""
    find_hits, query_for = tracer.closest_hits, query_of(tracer)
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
        # Of each query its ray's number, and the length in unit space of a device unit along it.
        searched, stretches = wp.zeros(shape=size, dtype=wp.int32), wp.zeros(shape=size, dtype=wp.float32)
        lead = int(-1)  # the first ray that is alive: objects are searched in the order in which it enters them
        for i in range(begin, end):
            set_miss(hits, i)
            if lead < 0 and rays.source[i] >= 0:
                lead = i
        run = begin / RUN
        listed = wp.where(lead >= 0, objects_listed(sets, objects.shape[0], run), 0)
        for group in range(0, listed, GROUP):
            left = ~wp.uint32(0) >> wp.uint32(GROUP - wp.min(GROUP, listed - group))
            while left != wp.uint32(0):
                entry = first_entered(objects, sets, run, group, left, rays.origin[lead], rays.direction[lead])
                left = left & ~(wp.uint32(1) << wp.uint32(entry - group))
                k = object_listed(sets, run, entry)

                # Search for the rays that may meet it.
                count = int(0)
                for i in range(begin, end):
                    if can_meet(sets, rays, run, entry, k, i):
                        if to_infinity or may_meet(objects[k], rays.origin[i], rays.direction[i], hits.t[i]):
                            t_max = wp.where(to_infinity, wp.inf, BEYOND * hits.t[i])
                            ray = into_unit(objects[k], rays.origin[i], rays.direction[i])
                            queries[count] = query_for(views, objects, k, rays, i, ray, t_max)
                            searched[count] = i
                            stretches[count] = ray.stretch
                            count += 1
                if count > 0:
                    find_hits(views, k, queries, count, found)
                for j in range(count):
                    keep_found(objects[k], rays, searched[j], k, stretches[j], found[j], to_infinity, hits)

    return closest_hits
