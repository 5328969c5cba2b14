"""What points of the image between the pixels' centres see: the camera's rays through them, traced.

They are handed on as a G-buffer of their own, whose pixels are these points in a row: so whatever is computed of an
image can be computed of them.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer, GBufferView
from ldtrefl.frame.regions import Regions, safe_regions
from ldtrefl.frame.visibility import leads_on
from ldtrefl.geometry.sphere import sphere_entry
from ldtrefl.geometry.vectors import as_single
from ldtrefl.tracing.closest_hits import closest_hits_kernel
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_hits, empty_rays
from ldtrefl.tracing.tracer import BoundTracer, block_of
from ldtrefl.world.camera import CameraView, camera_ray
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.top_level import TopLevel

NO_OBJECT = wp.constant(2147483647)
"""The source of rays that leave the camera: no object has this number."""


@dataclass(frozen=True, eq=False)
class SamplePoints(GBuffer):
    """What a camera sees at points of a band."""

    @property
    def shape(self) -> tuple[int, int]:
        """(1, points)."""
        return 1, self.pixel_count

    @property
    def pixel_count(self) -> int:
        """Points."""
        return int(self.view.place.shape[0])

    @functools.cached_property
    def reflector_pixels(self) -> wp.array:
        """(m,) int32: the points that see a reflector, in their order."""
        numbers = np.flatnonzero(self.view.reflector.numpy()).astype(np.int32)
        return wp.array(numbers, dtype=wp.int32, device=self.scene.device)


@launch.kernel
def start_camera_rays(
    first: int,
    # In:
    camera: CameraView,
    place: wp.array(dtype=wp.vec2d),
    top: TopLevel,
    # Out:
    rays: RayBuffer,
):
    """Start the camera's ray through one point of the image, where it enters the sphere about the whole scene: rounding
    of its direction is then that of the scene's size, however far the eye is."""
    i = first + wp.tid()
    exact = wp.normalize(camera_ray(camera, place[i][0], place[i][1]))
    direction = as_single(exact)
    entry = float(0.0)
    if top.root >= 0:
        entry = wp.max(sphere_entry(camera.eye, direction, top.nodes[top.root].centre, top.nodes[top.root].radius), 0.0)
    rays.pixel[i] = i
    rays.origin[i] = camera.eye + wp.float64(entry) * exact
    rays.direction[i] = direction
    rays.throughput[i] = wp.vec3(1.0)
    rays.source[i] = NO_OBJECT
    rays.source_triangle[i] = 0
    rays.may_return[i] = wp.uint8(1)


@launch.kernel
def find_mirrors(
    first: int,
    # In:
    objects: wp.array(dtype=ObjectRecord),
    looks: Looks,
    # In and out: the objects and triangles that are seen; the reflectors
    seen: GBufferView,
):
    """Find out whether one point sees a reflector."""
    i = first + wp.tid()
    is_mirror = int(0)
    if seen.object[i] >= 0:
        is_mirror = leads_on(objects, looks, seen, i, objects[seen.object[i]].reflects)
    seen.reflector[i] = wp.where(is_mirror != 0, wp.uint8(1), wp.uint8(0))


def camera_rays(image: GBuffer, place: wp.array) -> RayBuffer:
    """The camera's rays through (n,) vec2d points of a band's image, in its pixels."""
    scene, count = image.scene, place.shape[0]
    rays = empty_rays(count, scene.device)
    launch.launch(start_camera_rays, count, [image.view.camera, place, scene.top_level, rays], scene.device)
    return rays


def regions_of(image: GBuffer, rays: RayBuffer) -> Regions:
    """Which objects these rays of the camera can meet."""
    return safe_regions(image, rays, 1, Stats())


def seen_at(
    image: GBuffer, place: wp.array, rays: RayBuffer, regions: Regions, tracer: BoundTracer, *, by_bounds: bool
) -> SamplePoints:
    """What points see, by a tracer that is ready for the objects that their rays can meet.

    Args:
        image: the band that they are points of.
        place: (n,) vec2d in its pixels.
        rays: those of :func:`camera_rays`.
        by_bounds: an object is searched only where a ray enters its sphere.
    """
    scene, device, count = image.scene, image.scene.device, place.shape[0]
    hits, block = empty_hits(count, device), block_of(device)
    kernel = closest_hits_kernel(tracer.tracer, block, by_bounds)
    inputs = [rays, scene.records, tracer.views, regions.sets, hits]
    launch.launch(kernel, -(-count // block), inputs, device)
    view = GBufferView()
    view.object, view.triangle = hits.object, hits.triangle
    view.reflector = wp.empty(count, dtype=wp.uint8, device=device)
    view.camera, view.place = image.view.camera, place
    launch.launch(find_mirrors, count, [scene.records, scene.looks, view], device)
    return SamplePoints(scene, image.camera, view, image.band)
