"""Shading of what the camera sees, without what reflectors reflect; and the start of the reflected rays."""

from dataclasses import dataclass

import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.gbuffer import GBuffer, GBufferView, pixel_ray, pixel_surface, pixel_view
from ldtrefl.frame.shadows import direct_radiance_of
from ldtrefl.shading.environment import environment_radiance
from ldtrefl.shading.specular import mirror_direction
from ldtrefl.shading.surface import Surface, may_return
from ldtrefl.tracing.nothing import no_shadows
from ldtrefl.tracing.ray_buffers import RayBuffer, empty_rays
from ldtrefl.tracing.tracer import BoundTracer, Tracer
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.top_level import TopLevel


@launch.once
def shade_pixels_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that shades what the camera sees, reflectors left out."""
    direct_radiance = direct_radiance_of(tracer)

    @launch.kernel
    def shade_pixels(
        first: int,
        # In:
        gbuffer: GBufferView,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        views: wp.array(dtype=tracer.view),
        # Out:
        radiance_out: wp.array(dtype=wp.vec3),
    ):
        """Shade one pixel, unless it sees a reflector."""
        i = first + wp.tid()
        if gbuffer.object[i] < 0:
            radiance_out[i] = environment_radiance(lighting, wp.normalize(pixel_ray(gbuffer, i)))
        elif gbuffer.reflector[i] == wp.uint8(0):
            surface = pixel_surface(gbuffer, objects, i, pixel_view(gbuffer, objects, i))
            radiance_out[i] = direct_radiance(views, objects, top, lighting, surface)

    return shade_pixels


@wp.func
def start_ray(rays: RayBuffer, i: int, objects: wp.array(dtype=ObjectRecord), surface: Surface, direction: wp.vec3):
    """Start ray ``i`` at a surface that is seen along unit ``direction``, in the mirrored direction."""
    rays.origin[i] = surface.position
    rays.direction[i] = mirror_direction(direction, surface.normal, surface.facet)
    rays.throughput[i] = wp.vec3(1.0)
    rays.source[i] = surface.object
    rays.source_triangle[i] = surface.triangle
    rays.may_return[i] = wp.where(may_return(objects[surface.object], surface), wp.uint8(1), wp.uint8(0))


@launch.once
def shade_reflectors_kernel(tracer: Tracer, starts_rays: bool) -> wp.Kernel:
    """The kernel that shades the pixels that see a reflector, without what it reflects, and starts their rays if
    ``starts_rays``."""
    direct_radiance, with_rays = direct_radiance_of(tracer), wp.constant(starts_rays)

    @launch.kernel
    def shade_reflectors(
        first: int,
        # In:
        pixels: wp.array(dtype=wp.int32),
        gbuffer: GBufferView,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        views: wp.array(dtype=tracer.view),
        # Out:
        rays: RayBuffer,
        radiance_out: wp.array(dtype=wp.vec3),
        mirror_out: wp.array(dtype=wp.vec3),  # of each of the pixels
    ):
        """Shade one pixel that sees a reflector."""
        i = first + wp.tid()
        pixel = pixels[i]
        view = pixel_view(gbuffer, objects, pixel)
        surface = pixel_surface(gbuffer, objects, pixel, view)
        radiance_out[pixel] = direct_radiance(views, objects, top, lighting, surface)
        mirror_out[i] = surface.mirror
        if with_rays:
            rays.pixel[i] = pixel
            start_ray(rays, i, objects, surface, view.direction)

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
    inputs = [gbuffer.view, scene.records, scene.top_level, scene.lighting, shadow.views]
    launch.launch(shade_pixels_kernel(shadow.tracer), gbuffer.pixel_count, [*inputs, radiance], device)
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
    mirror, rays = wp.empty(count, dtype=wp.vec3, device=device), empty_rays(count if starts_rays else 0, device)
    inputs = [pixels, gbuffer.view, scene.records, scene.top_level, scene.lighting, shadow.views]
    kernel = shade_reflectors_kernel(shadow.tracer, starts_rays)
    launch.launch(kernel, count, [*inputs, rays, radiance, mirror], device)
    return Shaded(radiance, mirror, rays)
