"""Cube maps that are read where a reflected ray meets a sphere or a box that stands for all that the map shows.

    l = x + t R,    radiance = map(l)

x is where the ray starts and R its direction, both relative to the map's centre; t is where it leaves the sphere or the
box. K. Bjorke, "Image-Based Lighting", GPU Gems (2004), chapter 19, has the sphere. S. Lagarde and A. Zanuttini, "Local
Image-based Lighting With Parallax-corrected Cubemap" (SIGGRAPH 2012 talks), have the box, as B. Behc had in 2010.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.box import box_span
from ldtrefl.geometry.vectors import from_to
from ldtrefl.methods.cube_maps.faces import look_up
from ldtrefl.tracing.ray_buffers import RayBuffer


@wp.func
def point_on_sphere(start: wp.vec3, direction: wp.vec3, radius: float) -> wp.vec3:
    """Where a ray from ``start`` leaves a sphere about 0: the larger root of |x + t R|^2 = r^2. Its direction alone if
    it does not meet the sphere, or the sphere is infinitely large."""
    along = wp.dot(start, direction)
    aside = start - along * direction
    half_chord_squared = radius * radius - wp.dot(aside, aside)
    t = wp.sqrt(wp.max(half_chord_squared, 0.0)) - along
    if t > 0.0 and t < wp.inf and half_chord_squared > 0.0:
        return start + t * direction
    return direction


@wp.func
def point_on_box(start: wp.vec3, direction: wp.vec3, low: wp.vec3, high: wp.vec3) -> wp.vec3:
    """Where a ray from ``start`` leaves a box; its direction alone if it does not meet the box, or leaves it by a side
    that is infinitely far."""
    span = box_span(low, high, start, direction)
    if span[1] >= span[0] and span[1] < wp.inf:
        return start + span[1] * direction
    return direction


@launch.kernel
def reflect_sphere(
    first: int,
    # In:
    rays: RayBuffer,
    reflector: int,
    cube: wp.array(dtype=wp.vec3),
    resolution: int,
    centre: wp.vec3d,
    radius: float,
    # Out:
    radiance_out: wp.array(dtype=wp.vec3),
):
    """Look up where one ray meets the sphere, if it leaves this reflector."""
    i = first + wp.tid()
    if rays.source[i] == reflector:
        point = point_on_sphere(from_to(centre, rays.origin[i]), rays.direction[i], radius)
        radiance_out[i] = look_up(cube, resolution, wp.normalize(point))


@launch.kernel
def reflect_box(
    first: int,
    # In:
    rays: RayBuffer,
    reflector: int,
    cube: wp.array(dtype=wp.vec3),
    resolution: int,
    centre: wp.vec3d,
    low: wp.vec3,
    high: wp.vec3,
    # Out:
    radiance_out: wp.array(dtype=wp.vec3),
):
    """Look up where one ray meets the box, if it leaves this reflector."""
    i = first + wp.tid()
    if rays.source[i] == reflector:
        point = point_on_box(from_to(centre, rays.origin[i]), rays.direction[i], low, high)
        radiance_out[i] = look_up(cube, resolution, wp.normalize(point))
