"""A reflected ray's life, written once for every tracer.

    start at the reflector -> closest hit over all other objects -> shade, or environment -> bounce, or end

Rays live in arrays; a bounce is two launches, ``closest_hits`` and ``shade_hits``, both built from a tracer. When the
bounces are used up, a mirror reflects the environment alone. What each ray brings is added up by itself, and the rays
of a pixel are then summed in their order, so that no bit depends on threads.

Device space throughout; directions have unit length.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.regions import Regions
from ldtrefl.frame.shadows import direct_radiance_of
from ldtrefl.frame.skip_options import SkipOptions
from ldtrefl.geometry.vectors import point_along
from ldtrefl.shading.environment import environment_radiance
from ldtrefl.shading.specular import mirror_direction
from ldtrefl.shading.surface import extended_coordinates, surface_at
from ldtrefl.tracing.closest_hits import closest_hits_kernel
from ldtrefl.tracing.nothing import no_shadows
from ldtrefl.tracing.object_sets import ObjectSets
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer, cloned, empty_hits
from ldtrefl.tracing.tracer import BoundTracer, Tracer, block_of
from ldtrefl.world.records import LightingRecord, ObjectRecord


@launch.once
def shade_hits_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that adds what rays met to what they bring, and sends them on from mirrors."""
    direct_radiance = direct_radiance_of(tracer)

    @launch.kernel
    def shade_hits(
        first: int,
        # In:
        hits: HitBuffer,
        objects: wp.array(dtype=ObjectRecord),
        lighting: LightingRecord,
        views: wp.array(dtype=tracer.view),
        is_last: int,
        # In and out:
        rays: RayBuffer,
        radiance: wp.array(dtype=wp.vec3),  # that each ray brings
    ):
        """Shade what one ray has met."""
        i = first + wp.tid()
        if rays.source[i] < 0:
            return
        direction = rays.direction[i]
        throughput = rays.throughput[i]
        index = hits.object[i]
        source = int(-1)
        if index < 0:
            radiance[i] = radiance[i] + wp.cw_mul(throughput, environment_radiance(lighting, direction))
        else:
            uv = hits.barycentrics[i]
            point = point_along(rays.origin[i], direction, hits.t[i])
            if uv[0] < 0.0:
                uv = extended_coordinates(objects[index], hits.triangle[i], point)
            surface = surface_at(objects, index, hits.triangle[i], uv[0], uv[1], direction)
            # Shade at the point on the ray: what a map answers lies a little off the triangle.
            surface.position = point
            light = direct_radiance(views, objects, lighting, surface)
            if wp.max(surface.mirror) > 0.0:
                onwards = mirror_direction(direction, surface.normal)
                if is_last != 0:
                    light += wp.cw_mul(surface.mirror, environment_radiance(lighting, onwards))
                else:
                    rays.origin[i] = surface.position
                    rays.direction[i] = onwards
                    rays.throughput[i] = wp.cw_mul(throughput, surface.mirror)
                    rays.source_triangle[i] = hits.triangle[i]
                    source = index
            radiance[i] = radiance[i] + wp.cw_mul(throughput, light)
        rays.source[i] = source

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


class Guide(Protocol):
    """A method's part in a bounce: which objects rays can meet, and the tracer that answers them."""

    def regions(self, gbuffer: GBuffer, rays: RayBuffer, bounce: int, stats: Stats) -> Regions:
        """Which objects the rays of a bounce can meet; bounce 0 is the first."""

    def traced(self, objects: set[int], stats: Stats) -> BoundTracer:
        """The tracer for rays that can meet these objects."""


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


@dataclass(frozen=True, eq=False)
class RayFollower:
    """Follows the reflected rays of a frame, bounce by bounce."""

    gbuffer: GBuffer
    guide: Guide
    max_bounces: int
    skip: SkipOptions
    stats: Stats

    def first_regions(self, rays: RayBuffer) -> Regions:
        """Which objects the first rays can meet."""
        with self.stats.stage("cull", self.gbuffer.scene.device):
            return self.guide.regions(self.gbuffer, rays, 0, self.stats)

    def follow(self, rays: RayBuffer, regions: Regions) -> FollowedRays:
        """Follow rays until they end; ``regions`` are the first bounce's."""
        device, count = self.gbuffer.scene.device, rays.pixel.shape[0]
        radiance = wp.zeros(count, dtype=wp.vec3, device=device)
        hits = first_hits = empty_hits(count, device)
        followed = FollowedRays(rays, regions.sets, first_hits, radiance)
        # Bounces change the rays; the last one writes nothing but the source.
        going = cloned(RayBuffer, rays, ("source",) if self.max_bounces == 1 else None)
        for bounce in range(self.max_bounces):
            is_last = bounce + 1 == self.max_bounces
            if not self.bounce(going, regions, hits, radiance, is_last=is_last):
                break
            with self.stats.stage("cull", device):
                regions = self.guide.regions(self.gbuffer, going, bounce + 1, self.stats)
            hits = empty_hits(count, device)
        return followed

    def bounce(self, rays: RayBuffer, regions: Regions, hits: HitBuffer, radiance: wp.array, *, is_last: bool) -> int:
        """Find where rays end and shade that; returns the number of rays that go on."""
        scene, device, count = self.gbuffer.scene, self.gbuffer.scene.device, rays.pixel.shape[0]
        tracer = self.guide.traced(self._needed(regions), self.stats)
        with self.stats.stage("march", device):
            inputs = [rays, scene.records, tracer.views, regions.sets, hits]
            block = block_of(device)
            kernel = closest_hits_kernel(tracer.tracer, block, self.skip.bounds)
            launch.launch(kernel, -(-count // block), inputs, device)
            self._count(rays, hits)
        with self.stats.stage("shade", device):
            shadow = tracer if scene.lighting.shadows else no_shadows(device)
            inputs = [hits, scene.records, scene.lighting, shadow.views, int(is_last), rays, radiance]
            launch.launch(shade_hits_kernel(shadow.tracer), count, inputs, device)
            return 0 if is_last else int(np.count_nonzero(rays.source.numpy() >= 0))

    def _needed(self, regions: Regions) -> set[int]:
        """The objects that the tracer must be ready for."""
        scene = self.gbuffer.scene
        if self.skip.maps and not scene.lighting.shadows:
            return regions.shown
        return {entry.index for entry in scene.objects}

    def _count(self, rays: RayBuffer, hits: HitBuffer) -> None:
        stats = self.stats
        alive = int(np.count_nonzero(rays.source.numpy() >= 0))
        searches = int(hits.searches.numpy().sum(dtype=np.int64))
        stats.count("rays", alive)
        stats.count("steps", int(hits.steps.numpy().sum(dtype=np.int64)))
        stats.count("searches", searches)
        stats.count("searches_saved", alive * (len(self.gbuffer.scene.objects) - 1) - searches)
