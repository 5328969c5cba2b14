"""Shading of what the camera sees, without what reflectors reflect; and the start of the reflected rays."""

from dataclasses import dataclass

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit
from ldtrefl.frame.backdrop import fill_backdrop, fill_lights
from ldtrefl.frame.gbuffer import GBuffer, GBufferView, pattern_place, sight
from ldtrefl.frame.shadows import shaded_by
from ldtrefl.geometry.vectors import from_to
from ldtrefl.shading.light_shapes import seen_light
from ldtrefl.shading.ray_footprint import leave, meet_from
from ldtrefl.shading.surface import Surface, may_return, way_onwards
from ldtrefl.shading.surfaces import GROUP, Sighting, look_from
from ldtrefl.tracing.nothing import no_shadows
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_rays
from ldtrefl.tracing.tracer import BoundTracer, Tracer, block_of
from ldtrefl.world.camera import CameraView, step_down, step_right
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.shading_features import ShadingFeatures
from ldtrefl.world.top_level import TopLevel

PIXELS_IN_A_ROW = 256
"""Pixels that one thread of a CPU shades in a row: what sees nothing is filled in together."""


@wp.func
def light_before(
    camera: CameraView,
    lighting: LightingRecord,
    sightings: wp.array(dtype=Sighting),
    lane: int,
    surfaces: wp.array(dtype=Surface),
) -> int:
    """The number of the light that hides a lane's surface from the camera; -1 if none does."""
    distance = wp.length(from_to(camera.eye, surfaces[lane].position))
    return seen_light(lighting, camera.eye, sightings[lane].view, distance)


@launch.once
def shade_pixels_kernel(tracer: Tracer, features: ShadingFeatures) -> wp.Kernel:
    """The kernel that shades what the camera sees, reflectors left out."""
    shaded, with_visible_lights = shaded_by(tracer, features), wp.constant(features.soft_light)
    filters = wp.constant(features.probes > 0)

    @launch.kernel
    def shade_pixels(
        first: int,
        # In:
        block: int,
        gbuffer: GBufferView,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        views: wp.array(dtype=tracer.view),
        # Out:
        radiance_out: wp.array(dtype=wp.vec3),
    ):
        """Shade a block of pixels, but for those that see a reflector."""
        sight_memory, surface_memory = wp.zeros(shape=GROUP, dtype=Sighting), wp.zeros(shape=GROUP, dtype=Surface)
        sightings = wp.array(ptr=sight_memory.ptr, shape=(GROUP,), dtype=Sighting)
        surfaces = wp.array(ptr=surface_memory.ptr, shape=(GROUP,), dtype=Surface)
        camera, to_right, to_below = gbuffer.camera, step_right(gbuffer.camera), step_down(gbuffer.camera)
        i = block * (first + wp.tid())
        end = wp.min(i + block, radiance_out.shape[0])
        while i < end:
            begin = int(i)
            while i < end and gbuffer.object[i] < 0:
                i += 1
            fill_backdrop(gbuffer, lighting, begin, i, radiance_out)
            if with_visible_lights:
                fill_lights(gbuffer, lighting, begin, i, radiance_out)
            begin = int(i)
            lanes = int(0)
            while i < wp.min(end, begin + GROUP) and gbuffer.object[i] >= 0:
                if gbuffer.reflector[i] == wp.uint8(0):
                    sight(gbuffer, i, sightings, i - begin)
                    lanes = lanes | (1 << (i - begin))
                i += 1
            look_from(objects, lanes, camera.eye, sightings, surfaces)
            if filters:
                meet_from(objects, lanes, camera.eye, to_right, to_below, False, sightings, surfaces)
            while lanes != 0:
                lane = lowest_bit(wp.uint64(lanes))
                lanes = lanes & (lanes - 1)
                light = int(-1)
                if with_visible_lights:
                    light = light_before(camera, lighting, sightings, lane, surfaces)
                if light >= 0:
                    radiance_out[begin + lane] = lighting.shaped[light].radiance
                else:
                    place = pattern_place(gbuffer, begin + lane)
                    leaving = shaded(views, objects, top, lighting, looks, sightings, lane, surfaces, place)
                    radiance_out[begin + lane] = leaving

    return shade_pixels


@wp.func
def start_ray(rays: RayBuffer, i: int, objects: wp.array(dtype=ObjectRecord), surface: Surface, direction: wp.vec3):
    """Start ray ``i`` at a surface that is seen along unit ``direction``, in the mirrored direction or straight on. It
    is dead where the surface reflects nothing: a look may say so from place to place."""
    rays.origin[i] = surface.position
    rays.direction[i] = way_onwards(surface, direction)
    rays.throughput[i] = wp.vec3(1.0)
    rays.source[i] = wp.where(wp.max(surface.mirror) > 0.0, surface.object, -1)
    rays.source_triangle[i] = surface.triangle
    rays.may_return[i] = wp.where(may_return(objects[surface.object], surface), wp.uint8(1), wp.uint8(0))


@launch.once
def shade_reflectors_kernel(tracer: Tracer, starts_rays: bool, features: ShadingFeatures) -> wp.Kernel:
    """The kernel that shades the pixels that see a reflector, without what it reflects, and starts their rays if
    ``starts_rays``; with their footprints, if the scene has textures that are filtered."""
    shaded, with_rays = shaded_by(tracer, features), wp.constant(starts_rays)
    with_visible_lights, with_footprints = wp.constant(features.soft_light), wp.constant(features.footprints)

    @launch.kernel
    def shade_reflectors(
        first: int,
        # In:
        block: int,
        pixels: wp.array(dtype=wp.int32),
        gbuffer: GBufferView,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        views: wp.array(dtype=tracer.view),
        # Out:
        rays: RayBuffer,
        radiance_out: wp.array(dtype=wp.vec3),
        mirror_out: wp.array(dtype=wp.vec3),  # of each of the pixels
    ):
        """Shade a block of pixels that see reflectors."""
        sight_memory, surface_memory = wp.zeros(shape=GROUP, dtype=Sighting), wp.zeros(shape=GROUP, dtype=Surface)
        sightings = wp.array(ptr=sight_memory.ptr, shape=(GROUP,), dtype=Sighting)
        surfaces = wp.array(ptr=surface_memory.ptr, shape=(GROUP,), dtype=Surface)
        camera, to_right, to_below = gbuffer.camera, step_right(gbuffer.camera), step_down(gbuffer.camera)
        begin = block * (first + wp.tid())
        end = wp.min(begin + block, pixels.shape[0])
        while begin < end:
            count = wp.min(GROUP, end - begin)
            for lane in range(count):
                sight(gbuffer, pixels[begin + lane], sightings, lane)
            look_from(objects, (1 << count) - 1, camera.eye, sightings, surfaces)
            if with_footprints:
                meet_from(objects, (1 << count) - 1, camera.eye, to_right, to_below, True, sightings, surfaces)
            for lane in range(count):
                pixel = pixels[begin + lane]
                place = pattern_place(gbuffer, pixel)
                radiance_out[pixel] = shaded(views, objects, top, lighting, looks, sightings, lane, surfaces, place)
                if with_visible_lights:
                    light = light_before(camera, lighting, sightings, lane, surfaces)
                    if light >= 0:  # it hides the mirror
                        radiance_out[pixel] = lighting.shaped[light].radiance
                        surfaces[lane].mirror = wp.vec3(0.0)
                mirror_out[begin + lane] = surfaces[lane].mirror
                if with_rays:
                    rays.pixel[begin + lane] = pixel
                    start_ray(rays, begin + lane, objects, surfaces[lane], sightings[lane].view)
                    if with_footprints:
                        leaving = rays.direction[begin + lane]
                        rays.footprint[begin + lane] = leave(surfaces[lane], sightings, lane, leaving)
            begin += count

    return shade_reflectors


@dataclass(frozen=True, eq=False)
class Shaded:
    """What the camera sees, without what reflectors reflect."""

    radiance: wp.array
    """(h * w,) vec3, reflections left out."""
    mirror: wp.array
    """(m,) vec3: specular reflectance in each of the G-buffer's ``reflector_pixels``."""
    rays: RayBuffer
    """The rays of the first reflection, one for each of those pixels and in their order; none if none are started."""


def shade_gbuffer(
    gbuffer: GBuffer, shadow: BoundTracer, *, starts_rays: bool, radiance: wp.array | None = None
) -> Shaded:
    """Shade every pixel with the shadows that ``shadow`` answers; start the rays of those that see a reflector."""
    scene, device = gbuffer.scene, gbuffer.scene.device
    if radiance is None or radiance.shape[0] != gbuffer.pixel_count:
        radiance = wp.empty(gbuffer.pixel_count, dtype=wp.vec3, device=device)
    block = PIXELS_IN_A_ROW if device.is_cpu else 1
    inputs = [block, gbuffer.view, scene.records, scene.top_level, scene.lighting, scene.looks, shadow.views, radiance]
    kernel = shade_pixels_kernel(shadow.tracer, scene.features)
    launch.launch(kernel, -(-gbuffer.pixel_count // block), inputs, device)
    return _with_reflectors(gbuffer, shadow, radiance, starts_rays=starts_rays)


def first_rays(gbuffer: GBuffer) -> RayBuffer:
    """The rays of the first reflection alone, as :func:`shade_gbuffer` starts them."""
    device = gbuffer.scene.device
    radiance = wp.empty(gbuffer.pixel_count, dtype=wp.vec3, device=device)
    return _with_reflectors(gbuffer, no_shadows(device), radiance, starts_rays=True).rays


def _with_reflectors(gbuffer: GBuffer, shadow: BoundTracer, radiance: wp.array, *, starts_rays: bool) -> Shaded:
    """Shade the pixels that see a reflector, where the others are shaded; start their rays."""
    scene, device, pixels = gbuffer.scene, gbuffer.scene.device, gbuffer.reflector_pixels
    count = pixels.shape[0]
    mirror = wp.empty(count, dtype=wp.vec3, device=device)
    rays = empty_rays(count if starts_rays else 0, device, carries_footprints=scene.features.footprints)
    block = block_of(device)
    kernel = shade_reflectors_kernel(shadow.tracer, starts_rays, scene.features)
    inputs = [block, pixels, gbuffer.view, scene.records, scene.top_level, scene.lighting, scene.looks, shadow.views]
    launch.launch(kernel, -(-count // block), [*inputs, rays, radiance, mirror], device)
    return Shaded(radiance, mirror, rays)
