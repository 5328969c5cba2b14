"""The second layer of a cube map: what stands behind what the map shows.

Depth peeling by rays: that of each texel goes on from the surface that the texel sees to the next one, as the tracer
finds it. What they see is handed on as a G-buffer, which is shaded as every other.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer, GBufferView, ray_through
from ldtrefl.frame.regions import FEW_OBJECTS, safe_regions
from ldtrefl.frame.sample_points import find_mirrors
from ldtrefl.geometry.vectors import as_single
from ldtrefl.tracing.closest_hits import closest_hits_kernel
from ldtrefl.tracing.object_sets import ObjectSets, run_count
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_hits, empty_rays
from ldtrefl.tracing.tracer import BoundTracer, block_of
from ldtrefl.world.device_scene import DeviceScene

PEELING_BYTES = 200
"""Bytes of a texel on the way: what it sees and where, its ray and where that ends."""


@launch.kernel
def go_behind(
    first: int,
    # In:
    seen: GBufferView,
    position: wp.array(dtype=wp.vec3d),
    # Out:
    rays: RayBuffer,
):
    """Let the ray of one texel go on from the surface that it sees; it is dead where it sees none."""
    i = first + wp.tid()
    rays.pixel[i] = i
    rays.origin[i] = position[i]
    rays.direction[i] = as_single(wp.normalize(ray_through(seen, i)))
    rays.throughput[i] = wp.vec3(1.0)
    rays.source[i] = seen.object[i]
    rays.source_triangle[i] = seen.triangle[i]
    rays.may_return[i] = wp.uint8(1)


def seen_behind(gbuffer: GBuffer, tracer: BoundTracer, without: int, *, by_bounds: bool) -> GBuffer:
    """What stands behind what a G-buffer sees.

    Args:
        gbuffer: the first layer.
        tracer: ready for all objects.
        without: the number of an object that is left out.
        by_bounds: an object is searched only where a ray enters its sphere.
    """
    scene, count = gbuffer.scene, gbuffer.pixel_count
    device, block = scene.device, block_of(scene.device)
    rays, hits = empty_rays(count, device), empty_hits(count, device)
    launch.launch(go_behind, count, [gbuffer.view, gbuffer.surfaces[0], rays], device)
    sets = _sets_without(gbuffer, rays, without)
    inputs = [rays, scene.records, tracer.views, sets, hits]
    launch.launch(closest_hits_kernel(tracer.tracer, block, by_bounds), -(-count // block), inputs, device)
    view = GBufferView()
    view.object, view.triangle = hits.object, hits.triangle
    view.reflector = wp.zeros(count, dtype=wp.uint8, device=device)
    view.camera, view.place = gbuffer.view.camera, gbuffer.view.place
    launch.launch(find_mirrors, count, [scene.records, scene.looks, view], device)
    return dataclasses.replace(gbuffer, view=view)


def _sets_without(gbuffer: GBuffer, rays: RayBuffer, without: int) -> ObjectSets:
    """Which objects each ray can meet: all but one."""
    scene, runs = gbuffer.scene, run_count(rays.source.shape[0])
    if len(scene.objects) <= FEW_OBJECTS:
        return _all_without(scene, runs, without)
    sets = safe_regions(gbuffer, rays, 1, Stats()).sets
    is_kept = sets.object.numpy() != without
    bits = np.where(is_kept, sets.rays.numpy(), np.uint64(0))
    sets.rays = wp.array(bits, dtype=wp.uint64, device=scene.device)
    return sets


def _all_without(scene: DeviceScene, runs: int, without: int) -> ObjectSets:
    """Every run has the same list."""
    others = np.delete(np.arange(len(scene.objects), dtype=np.int32), without)
    sets = ObjectSets()
    sets.start = wp.zeros(runs, dtype=wp.int32, device=scene.device)
    sets.count = wp.full(runs, len(others), dtype=wp.int32, device=scene.device)
    sets.object = wp.array(others, dtype=wp.int32, device=scene.device)
    every = np.full(len(others), np.iinfo(np.uint64).max, np.uint64)
    sets.rays = wp.array(every, dtype=wp.uint64, device=scene.device)
    return sets
