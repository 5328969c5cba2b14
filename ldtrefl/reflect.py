"""A reflected ray's life, written once for every tracer.

    start at the reflector -> closest hit over all other objects -> shade, or environment -> bounce, or end

Rays live in arrays; a bounce is two launches, ``closest_hits`` and ``shade_hits``, both built from a tracer (a factory
closes over its functions). A surface's own object is left out of the search: reflectors do not yet reflect themselves.
When the bounces are used up, a mirror reflects the environment alone.

Device space throughout; directions have unit length.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.camera import camera_ray
from ldtrefl.cull import ReflectionRegions, can_show
from ldtrefl.device_scene import DeviceScene, LightingRecord, ObjectRecord
from ldtrefl.gbuffer import GBuffer, GBufferView, pixel_view
from ldtrefl.shade import (
    Surface,
    environment_radiance,
    extended_coordinates,
    make_direct_radiance,
    mirror_direction,
    surface_at,
)
from ldtrefl.trace import Hit, Tracer, no_hit


@wp.struct
class RayBuffer:
    """Rays on their way; a ray is dead where its source is -1."""

    pixel: wp.array(dtype=wp.int32)
    origin: wp.array(dtype=wp.vec3)
    direction: wp.array(dtype=wp.vec3)
    weight: wp.array(dtype=wp.vec3)  # what a unit of radiance met now adds to the pixel
    source: wp.array(dtype=wp.int32)  # the object that it left
    row: wp.array(dtype=wp.int32)  # its triangle's row in the reflection regions, -1 for none


@wp.struct
class HitBuffer:
    """Where the rays of a ``RayBuffer`` end."""

    t: wp.array(dtype=float)  # device units, +inf on a miss
    object: wp.array(dtype=wp.int32)
    triangle: wp.array(dtype=wp.int32)
    barycentrics: wp.array(dtype=wp.vec2)
    steps: wp.array(dtype=wp.int32)


@dataclass(frozen=True, eq=False)
class BoundTracer:
    """A tracer and its views of the scene's objects."""

    tracer: Tracer
    views: wp.array


@wp.struct
class NoView:
    """The view of a tracer that sees nothing."""

    unused: int


@wp.func
def never_hit(views: wp.array(dtype=NoView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float) -> Hit:
    """``closest_hit`` of a tracer that sees nothing."""
    return no_hit()


@wp.func
def never_occluded(
    views: wp.array(dtype=NoView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> bool:
    """``occluded`` of a tracer that sees nothing."""
    return False


NOTHING = Tracer("nothing", NoView, never_hit, never_occluded, clearance=0.0)
"""The tracer of scenes without shadows: kernels built from it hold no shadow rays."""


def no_shadows(device: wp.Device) -> BoundTracer:
    """``NOTHING``, bound."""
    return BoundTracer(NOTHING, wp.empty(0, dtype=NoView, device=device))


# Kernels built from a tracer.


@wp.func
def may_meet_sphere(origin: wp.vec3, direction: wp.vec3, t_max: float, centre: wp.vec3, radius: float) -> bool:
    """Whether a ray passes through a sphere before ``t_max``."""
    offset = centre - origin
    along = wp.dot(offset, direction)
    aside = offset - along * direction
    half_chord_squared = radius * radius - wp.dot(aside, aside)
    if half_chord_squared < 0.0:
        return False
    half_chord = wp.sqrt(half_chord_squared)
    return along + half_chord >= 0.0 and along - half_chord < t_max


@functools.cache
def closest_hits_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that finds where rays end."""
    closest_hit = tracer.closest_hit

    @launch.kernel
    def closest_hits(
        first: int,
        # In:
        rays: RayBuffer,
        objects: wp.array(dtype=ObjectRecord),
        views: wp.array(dtype=tracer.view),
        region_bits: wp.array2d(dtype=wp.uint32),
        # Out:
        hits: HitBuffer,
    ):
        i = first + wp.tid()
        best = float(wp.inf)
        best_object = int(-1)
        best_triangle = int(-1)
        best_barycentrics = wp.vec2(0.0, 0.0)
        steps = int(0)
        if rays.source[i] >= 0:
            origin = rays.origin[i]
            direction = rays.direction[i]
            for k in range(objects.shape[0]):
                if (
                    k != rays.source[i]
                    and can_show(region_bits, rays.row[i], k)
                    and may_meet_sphere(origin, direction, best, objects[k].centre, objects[k].radius)
                ):
                    # t stays in device units: divide by the direction's length in unit space.
                    way = wp.transform_vector(objects[k].unit_from_device, direction)
                    stretch = wp.length(way)
                    start = wp.transform_point(objects[k].unit_from_device, origin)
                    hit = closest_hit(views, k, start, way / stretch, best * stretch)
                    steps += hit.steps
                    if hit.triangle >= 0 and hit.t / stretch < best:
                        best = hit.t / stretch
                        best_object = k
                        best_triangle = hit.triangle
                        best_barycentrics = wp.vec2(hit.u, hit.v)
        hits.t[i] = best
        hits.object[i] = best_object
        hits.triangle[i] = best_triangle
        hits.barycentrics[i] = best_barycentrics
        hits.steps[i] = steps

    return closest_hits


@functools.cache
def direct_radiance_of(tracer: Tracer) -> Any:
    """``direct_radiance`` with this tracer's shadows."""
    occluded = tracer.occluded
    clearance = wp.constant(tracer.clearance)
    view_type = tracer.view

    @wp.func
    def is_lit(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        surface: Surface,
        towards: wp.vec3,
        distance: float,
    ) -> bool:
        origin = surface.position + clearance * surface.facet
        for k in range(objects.shape[0]):
            if may_meet_sphere(origin, towards, distance, objects[k].centre, objects[k].radius):
                way = wp.transform_vector(objects[k].unit_from_device, towards)
                stretch = wp.length(way)
                start = wp.transform_point(objects[k].unit_from_device, origin)
                if occluded(views, k, start, way / stretch, distance * stretch):
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

    return make_direct_radiance(always_lit if view_type is NoView else is_lit)


@functools.cache
def shade_pixels_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that shades what the camera sees, reflections left out."""
    direct_radiance = direct_radiance_of(tracer)

    @launch.kernel
    def shade_pixels(
        first: int,
        # In:
        gbuffer: GBufferView,
        objects: wp.array(dtype=ObjectRecord),
        lighting: LightingRecord,
        views: wp.array(dtype=tracer.view),
        # Out:
        radiance_out: wp.array(dtype=wp.vec3),
        mirror_out: wp.array(dtype=wp.vec3),
    ):
        i = first + wp.tid()
        index = gbuffer.object[i]
        mirror_out[i] = wp.vec3(0.0)
        if index < 0:
            x, y = float(i % gbuffer.camera.width) + 0.5, float(i / gbuffer.camera.width) + 0.5
            radiance_out[i] = environment_radiance(lighting, wp.normalize(camera_ray(gbuffer.camera, x, y)))
        else:
            uv = gbuffer.barycentrics[i]
            view = pixel_view(gbuffer, objects, i)
            surface = surface_at(objects, index, gbuffer.triangle[i], uv[0], uv[1], view)
            radiance_out[i] = direct_radiance(views, objects, lighting, surface)
            mirror_out[i] = surface.mirror

    return shade_pixels


@functools.cache
def shade_hits_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that adds what rays met to their pixels, and sends them on from mirrors."""
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
        radiance: wp.array(dtype=wp.vec3),
    ):
        i = first + wp.tid()
        if rays.source[i] < 0:
            return
        direction = rays.direction[i]
        weight = rays.weight[i]
        pixel = rays.pixel[i]
        index = hits.object[i]
        source = int(-1)
        if index < 0:
            radiance[pixel] = radiance[pixel] + wp.cw_mul(weight, environment_radiance(lighting, direction))
        else:
            uv = hits.barycentrics[i]
            point = rays.origin[i] + hits.t[i] * direction
            if uv[0] < 0.0:
                uv = extended_coordinates(objects[index], hits.triangle[i], point)
            surface = surface_at(objects, index, hits.triangle[i], uv[0], uv[1], direction)
            # The ray's own point: a map's hit lies a little off the triangle.
            surface.position = point
            light = direct_radiance(views, objects, lighting, surface)
            if wp.max(surface.mirror) > 0.0:
                onwards = mirror_direction(direction, surface.normal)
                if is_last != 0:
                    light += wp.cw_mul(surface.mirror, environment_radiance(lighting, onwards))
                else:
                    rays.origin[i] = surface.position
                    rays.direction[i] = onwards
                    rays.weight[i] = wp.cw_mul(weight, surface.mirror)
                    rays.row[i] = -1
                    source = index
            radiance[pixel] = radiance[pixel] + wp.cw_mul(weight, light)
        rays.source[i] = source

    return shade_hits


@launch.kernel
def start_rays(
    first: int,
    # In:
    gbuffer: GBufferView,
    objects: wp.array(dtype=ObjectRecord),
    first_rows: wp.array(dtype=wp.int32),
    # In and out:
    rays: RayBuffer,
):
    i = first + wp.tid()
    pixel = rays.pixel[i]
    index = gbuffer.object[pixel]
    uv = gbuffer.barycentrics[pixel]
    view = pixel_view(gbuffer, objects, pixel)
    surface = surface_at(objects, index, gbuffer.triangle[pixel], uv[0], uv[1], view)
    rays.origin[i] = surface.position
    rays.direction[i] = mirror_direction(view, surface.normal)
    rays.weight[i] = wp.vec3(1.0)
    rays.source[i] = index
    rays.row[i] = -1
    if first_rows[index] >= 0:
        rays.row[i] = first_rows[index] + gbuffer.triangle[pixel]


@dataclass(frozen=True, eq=False)
class FirstHits:
    """Where the rays of the first reflection end, per pixel of the image; each picture is made when it is asked for."""

    shape: tuple[int, int]
    """(h, w) of the image."""
    rays: Any
    """A ``RayBuffer``: of each ray the pixel."""
    ends: Any
    """The ``HitBuffer`` of the first bounce."""
    device_units_per_world_unit: float

    @functools.cached_property
    def distance(self) -> np.ndarray:
        """(h, w) float32 world units along the ray; +inf on a miss and outside the reflectors."""
        return self._picture(self.ends.t, np.inf) / np.float32(self.device_units_per_world_unit)

    @functools.cached_property
    def object(self) -> np.ndarray:
        """(h, w) int32; -1 on a miss and outside the reflectors."""
        return self._picture(self.ends.object, -1)

    @functools.cached_property
    def triangle(self) -> np.ndarray:
        """(h, w) int32; -1 on a miss and outside the reflectors."""
        return self._picture(self.ends.triangle, -1)

    def _picture(self, values: wp.array, fill: float) -> np.ndarray:
        picture = np.full(self.shape[0] * self.shape[1], fill, values.numpy().dtype)
        picture[self.rays.pixel.numpy()] = values.numpy()
        return picture.reshape(self.shape)


def mirror_rays(gbuffer: GBuffer, regions: ReflectionRegions | None) -> Any:
    """The ``RayBuffer`` of the first reflection: one ray per pixel that sees a reflector."""
    scene, device = gbuffer.scene, gbuffer.scene.device
    pixels = np.flatnonzero(gbuffer.reflector_mask).astype(np.int32)
    n = len(pixels)
    rays = RayBuffer()
    rays.pixel = wp.array(pixels, dtype=wp.int32, device=device)
    rays.origin, rays.direction, rays.weight = (wp.empty(n, dtype=wp.vec3, device=device) for _ in range(3))
    rays.source, rays.row = (wp.empty(n, dtype=wp.int32, device=device) for _ in range(2))
    if regions is None:
        rows = wp.full(len(scene.objects), -1, dtype=wp.int32, device=device)
    else:
        rows = regions.first_rows
    launch.launch(start_rays, n, [gbuffer.view, scene.records, rows, rays], device)
    return rays


def follow_rays(
    gbuffer: GBuffer,
    regions: ReflectionRegions | None,
    bind: Callable[[set[int]], BoundTracer],
    max_bounces: int,
    stats: launch.Stats,
) -> tuple[wp.array, FirstHits]:
    """Reflected radiance of every pixel, (h * w,) vec3, and where the first rays end.

    ``bind(objects)`` makes the tracer ready for the numbers of the objects that rays may meet.
    """
    scene, device = gbuffer.scene, gbuffer.scene.device
    everything = {entry.index for entry in scene.objects}
    shadows = bool(scene.lighting.shadows)
    bound = bind(everything if shadows or max_bounces > 1 or regions is None else regions.shown)
    bits = wp.zeros((1, 1), dtype=wp.uint32, device=device) if regions is None else regions.bits
    with stats.stage("march", device):
        rays = mirror_rays(gbuffer, regions)
    n = rays.pixel.shape[0]
    stats.count("rays", n)
    radiance = wp.zeros(gbuffer.pixel_count, dtype=wp.vec3, device=device)
    shadow = bound if shadows else no_shadows(device)
    first_hits = None
    for bounce in range(max_bounces):
        with stats.stage("march", device):
            if bounce < 2:  # the first bounce's are kept
                hits = _hit_buffer(n, device)
            inputs = [rays, scene.records, bound.views, bits, hits]
            launch.launch(closest_hits_kernel(bound.tracer), n, inputs, device)
            stats.count("steps", int(hits.steps.numpy().sum(dtype=np.int64)))
        if first_hits is None:
            shape = (gbuffer.camera.height, gbuffer.camera.width)
            first_hits = FirstHits(shape, rays, hits, scene.device_units_per_world_unit)
        with stats.stage("shade", device):
            is_last = int(bounce + 1 == max_bounces)
            inputs = [hits, scene.records, scene.lighting, shadow.views, is_last, rays, radiance]
            launch.launch(shade_hits_kernel(shadow.tracer), n, inputs, device)
            alive = 0 if is_last else int((rays.source.numpy() >= 0).sum())
        if alive == 0:
            break
        stats.count("rays", alive)
    assert first_hits is not None
    return radiance, first_hits


def _hit_buffer(n: int, device: wp.Device) -> Any:
    hits = HitBuffer()
    hits.t = wp.empty(n, dtype=float, device=device)
    hits.object, hits.triangle, hits.steps = (wp.empty(n, dtype=wp.int32, device=device) for _ in range(3))
    hits.barycentrics = wp.empty(n, dtype=wp.vec2, device=device)
    return hits


def shade_gbuffer(gbuffer: GBuffer, shadow: BoundTracer) -> tuple[wp.array, wp.array]:
    """(radiance without reflections, specular reflectance) of every pixel, (h * w,) vec3 each."""
    scene: DeviceScene = gbuffer.scene
    radiance = wp.empty(gbuffer.pixel_count, dtype=wp.vec3, device=scene.device)
    mirror = wp.empty(gbuffer.pixel_count, dtype=wp.vec3, device=scene.device)
    inputs = [gbuffer.view, scene.records, scene.lighting, shadow.views, radiance, mirror]
    launch.launch(shade_pixels_kernel(shadow.tracer), gbuffer.pixel_count, inputs, scene.device)
    return radiance, mirror
