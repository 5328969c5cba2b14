"""What rays bring where they end, and how they go on from mirrors: what the kernel of a bounce is made of.

Device space throughout; directions have unit length.
"""

from collections.abc import Callable

import warp as wp

from ldtrefl.device import launch
from ldtrefl.shading.environment import environment_radiance
from ldtrefl.shading.light_shapes import seen_light
from ldtrefl.shading.ray_footprint import leave
from ldtrefl.shading.surface import Surface, may_return, way_onwards
from ldtrefl.shading.surfaces import Sighting
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer
from ldtrefl.world.records import LightingRecord, ObjectRecord


@wp.func
def go_on(
    objects: wp.array(dtype=ObjectRecord),
    lighting: LightingRecord,
    rays: RayBuffer,
    i: int,
    surface: Surface,
    least_weight: float,
    onwards_out: RayBuffer,
) -> wp.vec3:
    """Send ray ``i`` on from a mirror, or behind what lets it through; or, if too little of what it brings would
    arrive, what it would see there of the environment."""
    direction = way_onwards(surface, rays.direction[i])
    onwards = wp.cw_mul(rays.throughput[i], surface.mirror)
    if wp.max(onwards) < least_weight:
        return wp.cw_mul(surface.mirror, environment_radiance(lighting, direction))
    onwards_out.pixel[i] = rays.pixel[i]
    onwards_out.origin[i] = surface.position
    onwards_out.direction[i] = direction
    onwards_out.throughput[i] = onwards
    onwards_out.source[i] = surface.object
    onwards_out.source_triangle[i] = surface.triangle
    returns = may_return(objects[surface.object], surface)
    onwards_out.may_return[i] = wp.where(returns, wp.uint8(1), wp.uint8(0))
    return wp.vec3(0.0)


@wp.func
def carry_on(surface: Surface, sightings: wp.array(dtype=Sighting), lane: int, i: int, onwards_out: RayBuffer):
    """Let ray ``i`` have its footprint on from a lane's surface, if it goes on."""
    if onwards_out.source[i] >= 0:
        onwards_out.footprint[i] = leave(surface, sightings, lane, onwards_out.direction[i])


@wp.func
def brought_by(lighting: LightingRecord, rays: RayBuffer, i: int, light: int) -> wp.vec3:
    """What ray ``i``, which ends at no object, brings of the environment; or of a light, if the number is not -1."""
    if light >= 0:
        return wp.cw_mul(rays.throughput[i], lighting.shaped[light].radiance)
    return wp.cw_mul(rays.throughput[i], environment_radiance(lighting, rays.direction[i]))


@launch.once
def meeting_lights(are_visible: bool) -> Callable[..., int]:
    """``light_met(lighting, rays, hits, i)``: the number of the light whose shape ray ``i`` meets before what it has
    hit; -1 if it meets none, or none can be seen."""
    with_visible_lights = wp.constant(are_visible)

    @wp.func
    def light_met(lighting: LightingRecord, rays: RayBuffer, hits: HitBuffer, i: int) -> int:
        light = int(-1)
        if with_visible_lights:
            light = seen_light(lighting, rays.origin[i], rays.direction[i], hits.t[i])
        return light

    return light_met
