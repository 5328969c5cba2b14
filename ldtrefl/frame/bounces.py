"""A reflected ray's life, written once for every tracer.

    start at the reflector -> closest hit over all objects -> shade, or environment -> bounce, or end

Rays live in arrays; a bounce is two launches, ``closest_hits`` and ``shade_hits``, both built from a tracer. Rays that
go on from mirrors are then taken into arrays of their own. A mirror reflects the environment alone when the bounces
are used up, or when so little of what a ray brings would still arrive that it is not worth following. What each ray
brings is added up by itself, and the rays of a pixel are then summed in their order, so that no bit depends on threads.

Device space throughout; directions have unit length.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer, GBufferView, pattern_place
from ldtrefl.frame.ray_counts import counts_of
from ldtrefl.frame.ray_ends import brought_by, carry_on, go_on, meeting_lights
from ldtrefl.frame.regions import Regions
from ldtrefl.frame.shadows import shaded_by
from ldtrefl.frame.skip_options import SkipOptions
from ldtrefl.frame.taken_rays import taken
from ldtrefl.geometry.vectors import point_along
from ldtrefl.shading.ray_footprint import meet_along
from ldtrefl.shading.surface import Surface, extended_coordinates
from ldtrefl.shading.surfaces import GROUP, Sighting, look_along
from ldtrefl.tracing.closest_hits import closest_hits_kernel
from ldtrefl.tracing.nothing import no_shadows
from ldtrefl.tracing.object_sets import ObjectSets
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer, RayEnds, empty_hits, empty_rays
from ldtrefl.tracing.tracer import BoundTracer, Tracer, block_of
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.shading_features import ShadingFeatures
from ldtrefl.world.top_level import TopLevel

FARTHER = wp.constant(64.0)
"""Where a ray has come from more than this many of an object's radii away, its hit is placed by its barycentrics: along
the ray it is rounded by the ray's length, which may be many times the object."""

LATER_BYTES = 28
"""Bytes for each ray of a later bounce: where it ends is kept. Measured, with what the heap loses between arrays."""

MOST_BOUNCES = "reflection.max_bounces"
"""What an error names for the user to make smaller."""


@wp.func
def sight_hit(
    objects: wp.array(dtype=ObjectRecord),
    rays: RayBuffer,
    hits: HitBuffer,
    i: int,
    sightings: wp.array(dtype=Sighting),
    lane: int,
):
    """Let a lane of a group see what ray ``i`` has met."""
    uv = hits.barycentrics[i]
    if uv[0] < 0.0:  # one triangle stands for many
        point = point_along(rays.origin[i], rays.direction[i], hits.t[i])
        uv = extended_coordinates(objects[hits.object[i]], hits.triangle[i], point)
    sightings[lane].object = hits.object[i]
    sightings[lane].triangle = hits.triangle[i]
    sightings[lane].u = uv[0]
    sightings[lane].v = uv[1]
    sightings[lane].view = rays.direction[i]
    if rays.footprint.shape[0] > 0:
        sightings[lane].t = hits.t[i]
        sightings[lane].footprint = rays.footprint[i]


@wp.func
def placed_on_ray(
    objects: wp.array(dtype=ObjectRecord), rays: RayBuffer, hits: HitBuffer, i: int, on_triangle: wp.vec3d
) -> wp.vec3d:
    """Where ray ``i`` has met a surface: along the ray, or ``on_triangle`` where the ray is long."""
    # What a map answers lies a little off the triangle: such a point is shaded where it is.
    if hits.barycentrics[i][0] < 0.0 or not hits.t[i] > FARTHER * objects[hits.object[i]].radius:
        return point_along(rays.origin[i], rays.direction[i], hits.t[i])
    return on_triangle


@wp.func
def add_brought(radiance: wp.array(dtype=wp.vec3), numbers: wp.array(dtype=wp.int32), i: int, brought: wp.vec3):
    """Add what ray ``i`` brings; ``numbers`` are the rays' among the first bounce's, none if they are those."""
    number = int(i)
    if numbers.shape[0] > 0:
        number = numbers[i]
    radiance[number] = radiance[number] + brought


@launch.once
def shade_hits_kernel(tracer: Tracer, features: ShadingFeatures) -> wp.Kernel:
    """The kernel that adds what rays met to what they bring, and sends them on from mirrors."""
    shaded, light_met = shaded_by(tracer, features), meeting_lights(features.soft_light)
    with_footprints = wp.constant(features.footprints)

    @launch.kernel
    def shade_hits(
        first: int,
        # In:
        block: int,
        rays: RayBuffer,
        hits: HitBuffer,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        views: wp.array(dtype=tracer.view),
        gbuffer: GBufferView,
        numbers: wp.array(dtype=wp.int32),  # of the rays among the first bounce's; empty: they are those
        least_weight: float,
        # In and out:
        radiance: wp.array(dtype=wp.vec3),  # that each of the first bounce's rays brings
        # Out: the rays that go on, where a source is not -1
        onwards_out: RayBuffer,
    ):
        """Shade what a block of rays has met."""
        sight_memory, surface_memory = wp.zeros(shape=GROUP, dtype=Sighting), wp.zeros(shape=GROUP, dtype=Surface)
        sightings = wp.array(ptr=sight_memory.ptr, shape=(GROUP,), dtype=Sighting)
        surfaces = wp.array(ptr=surface_memory.ptr, shape=(GROUP,), dtype=Surface)
        begin, end = block * (first + wp.tid()), wp.min(block * (first + wp.tid()) + block, rays.source.shape[0])
        while begin < end:
            lanes = int(0)
            for i in range(begin, wp.min(begin + GROUP, end)):
                onwards_out.source[i] = -1
                if rays.source[i] >= 0:
                    light = light_met(lighting, rays, hits, i)
                    if hits.object[i] >= 0 and light < 0:
                        sight_hit(objects, rays, hits, i, sightings, i - begin)
                        lanes = lanes | (1 << (i - begin))
                    else:
                        add_brought(radiance, numbers, i, brought_by(lighting, rays, i, light))
            look_along(objects, lanes, sightings, surfaces)
            if with_footprints:
                meet_along(objects, lanes, sightings, surfaces)
            while lanes != 0:
                lane = lowest_bit(wp.uint64(lanes))
                lanes = lanes & (lanes - 1)
                i = begin + lane
                surfaces[lane].position = placed_on_ray(objects, rays, hits, i, surfaces[lane].position)
                place = pattern_place(gbuffer, rays.pixel[i])
                leaving = shaded(views, objects, top, lighting, looks, sightings, lane, surfaces, place)
                if wp.max(surfaces[lane].mirror) > 0.0:
                    leaving += go_on(objects, lighting, rays, i, surfaces[lane], least_weight, onwards_out)
                    if with_footprints:
                        carry_on(surfaces[lane], sightings, lane, i, onwards_out)
                add_brought(radiance, numbers, i, wp.cw_mul(rays.throughput[i], leaving))
            begin += GROUP

    return shade_hits


@launch.kernel
def sum_rays(
    first: int,
    # In:
    first_ray: wp.array(dtype=wp.int32),  # of each pixel; then the number of rays
    radiance: wp.array(dtype=wp.vec3),
    # Out:
    total_out: wp.array(dtype=wp.vec3),
):
    """Sum what the rays of one pixel bring, in their order."""
    i = first + wp.tid()
    total = wp.vec3(0.0)
    for k in range(first_ray[i], first_ray[i + 1]):
        total += radiance[k]
    total_out[i] = total


def summed_by_pixel(pixels: wp.array, rays: RayBuffer, radiance: wp.array) -> wp.array:
    """(m,) vec3: the radiance that the rays of each of (m,) pixels bring together.

    Args:
        pixels: every pixel once.
        rays: in the order of ``pixels``, those of a pixel in a row.
        radiance: (n,) vec3 that each ray brings.
    """
    count, device = pixels.shape[0], radiance.device
    if count == radiance.shape[0]:
        return radiance  # one ray a pixel
    is_first = np.diff(rays.pixel.numpy(), prepend=-1) != 0
    first_ray = np.append(np.flatnonzero(is_first), radiance.shape[0])
    total = wp.empty(count, dtype=wp.vec3, device=device)
    inputs = [wp.array(first_ray, dtype=wp.int32, device=device), radiance, total]
    launch.launch(sum_rays, count, inputs, device)
    return total


def shade_ends(
    gbuffer: GBuffer,
    rays: RayBuffer,
    hits: HitBuffer,
    shadow: BoundTracer,
    radiance: wp.array,
    *,
    numbers: np.ndarray | None = None,
    least_weight: float,
) -> RayBuffer:
    """Add what rays have met to what they bring, and send them on from mirrors.

    Args:
        gbuffer: what the camera sees.
        rays: (n,) as they set out.
        hits: where they end.
        shadow: the tracer that answers shadow rays.
        radiance: (m,) vec3 that each of the first bounce's rays brings.
        numbers: (n,) int32 of the rays among those; all of them if not given.
        least_weight: rays of which less would arrive end at a mirror, which reflects the environment alone.

    Returns:
        (n,) rays that go on, where a source is not -1.
    """
    scene, device, count = gbuffer.scene, gbuffer.scene.device, rays.pixel.shape[0]
    onwards = empty_rays(count, device, carries_footprints=scene.features.footprints)
    places = wp.array(np.empty(0, np.int32) if numbers is None else numbers, dtype=wp.int32, device=device)
    block = block_of(device)
    inputs = [block, rays, hits, scene.records, scene.top_level, scene.lighting, scene.looks, shadow.views]
    inputs += [gbuffer.view, places, least_weight, radiance, onwards]
    kernel = shade_hits_kernel(shadow.tracer, scene.features)
    launch.launch(kernel, -(-count // block), inputs, device)
    return onwards


class Guide(Protocol):
    """A method's part in a bounce: which objects rays can meet, and the tracer that answers them."""

    def regions(self, gbuffer: GBuffer, rays: RayBuffer, bounce: int, stats: Stats) -> Regions:
        """Which objects the rays of a bounce can meet; bounce 0 is the first."""

    def traced(self, objects: set[int], stats: Stats) -> BoundTracer:
        """The tracer for rays that can meet these objects."""


@dataclass(frozen=True)
class BounceLimits:
    """When rays end that could be followed further."""

    most: int
    """Reflections of a ray; 1 or more."""
    least_weight: float
    """A ray ends at a mirror if less than this share of what it meets next would still arrive."""


@dataclass(frozen=True, eq=False)
class LaterBounce:
    """Where rays ended that had been mirrored once or more on their way."""

    numbers: np.ndarray
    """(m,) int32: of these rays among the first bounce's."""
    ends: RayEnds
    """Of each of them."""


@dataclass(frozen=True, eq=False)
class KeptBounce:
    """A bounce as layers of a picture are made of it."""

    numbers: np.ndarray
    """(m,) int32: of the rays that were followed in it, among the first bounce's."""
    rays: RayBuffer
    """Those rays as they set out."""
    hits: HitBuffer
    """Where they ended."""
    brought: wp.array
    """(n,) vec3: what each of the first bounce's rays has brought by the end of this one."""


@dataclass(frozen=True, eq=False)
class FollowedRays:
    """Rays of the first bounce, and what became of them."""

    rays: RayBuffer
    """The rays as they started."""
    sets: ObjectSets
    """The objects that each could meet."""
    hits: HitBuffer
    """Where each ended after its first reflection."""
    radiance: wp.array
    """(n,) vec3 that each brings, by all of its bounces."""
    source_onwards: wp.array
    """(n,) int32: the mirror that each goes on from after that; -1 where it ends."""
    later: tuple[LaterBounce, ...] = ()
    """The bounces after the first."""
    kept: tuple[KeptBounce, ...] = ()
    """All bounces, if they are kept."""


@dataclass(frozen=True, eq=False)
class RayFollower:
    """Follows the reflected rays of a frame, bounce by bounce."""

    gbuffer: GBuffer
    guide: Guide
    limits: BounceLimits
    skip: SkipOptions
    stats: Stats
    keeps_bounces: bool = False
    """Whether each bounce is kept as it was, too."""

    def first_regions(self, rays: RayBuffer) -> Regions:
        """Which objects the first rays can meet."""
        return self._regions(rays, 0)

    def _regions(self, rays: RayBuffer, bounce: int) -> Regions:
        with self.stats.stage("cull", self.gbuffer.scene.device):
            return self.guide.regions(self.gbuffer, rays, bounce, self.stats)

    def follow(self, rays: RayBuffer, regions: Regions) -> FollowedRays:
        """Follow rays until they end; ``regions`` are the first bounce's.

        Raises:
            InputError: to keep where the rays of all bounces end needs more memory than is allowed.
        """
        device, count = self.gbuffer.scene.device, rays.pixel.shape[0]
        radiance, numbers = wp.zeros(count, dtype=wp.vec3, device=device), np.arange(count, dtype=np.int32)
        hits, onwards = self._bounce(rays, regions, None, radiance, is_last=self.limits.most == 1)
        followed = FollowedRays(rays, regions.sets, hits, radiance, onwards.source)
        later, kept = [], [KeptBounce(numbers, rays, hits, wp.clone(radiance))] if self.keeps_bounces else []
        with budget.given_back():
            for bounce in range(1, self.limits.most):
                left = np.flatnonzero(onwards.source.numpy() >= 0)
                if len(left) == 0:
                    break
                budget.take(LATER_BYTES * len(left), f"bounce {bounce + 1} of the reflected rays", MOST_BOUNCES)
                numbers, going = numbers[left], taken(onwards, left)
                regions = self._regions(going, bounce)
                is_last = bounce + 1 == self.limits.most
                hits, onwards = self._bounce(going, regions, numbers, radiance, is_last=is_last)
                later.append(LaterBounce(numbers, RayEnds.of(going, hits)))
                if self.keeps_bounces:
                    kept.append(KeptBounce(numbers, going, hits, wp.clone(radiance)))
        return replace(followed, later=tuple(later), kept=tuple(kept))

    def _bounce(
        self, rays: RayBuffer, regions: Regions, numbers: np.ndarray | None, radiance: wp.array, *, is_last: bool
    ) -> tuple[HitBuffer, RayBuffer]:
        """(where rays end, the rays that go on from there); what they bring is added to ``radiance`` at ``numbers``."""
        scene, device, count = self.gbuffer.scene, self.gbuffer.scene.device, rays.pixel.shape[0]
        tracer, hits = self.guide.traced(self._needed(regions), self.stats), empty_hits(count, device)
        with self.stats.stage("march", device):
            inputs = [rays, scene.records, tracer.views, regions.sets, hits]
            block = block_of(device)
            kernel = closest_hits_kernel(tracer.tracer, block, self.skip.bounds)
            launch.launch(kernel, -(-count // block), inputs, device)
            self._count(rays, hits)
        with self.stats.stage("shade", device):
            shadow = tracer if scene.scene.lighting.is_traced else no_shadows(device)
            weight = np.inf if is_last else self.limits.least_weight
            onwards = shade_ends(self.gbuffer, rays, hits, shadow, radiance, numbers=numbers, least_weight=weight)
        return hits, onwards

    def _needed(self, regions: Regions) -> set[int]:
        """The objects that the tracer must be ready for."""
        scene = self.gbuffer.scene
        if self.skip.maps and not scene.scene.lighting.is_traced:
            return regions.shown
        return {entry.index for entry in scene.objects}

    def _count(self, rays: RayBuffer, hits: HitBuffer) -> None:
        stats, found = self.stats, counts_of(rays, hits)
        stats.count("rays", found.alive)
        stats.count("steps", found.steps)
        stats.count("searches", found.searches)
        others = found.alive * (len(self.gbuffer.scene.objects) - 1)
        stats.count("searches_saved", others + found.returning - found.searches)
