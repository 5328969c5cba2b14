"""Layered distance maps: T. Umenhoffer, G. Patow, L. Szirmay-Kalos, "Robust Multiple Specular Reflections and
Refractions", GPU Gems 3 (2007), chapter 17.

The ray l(d) = x + d R starts at x in unit direction R, both relative to the map's centre. Each layer knows in the
direction of l how far its surface is, |l'|; the ratio |l| / |l'| passes 1 where the ray meets it. First a *linear
search* goes along the ray in steps that are equal on the map, so that none passes a surface of some texels' size: by
the law of sines the point that is seen from the centre at an angle a from x is at

    d = |x| sin(a) / sin(b - a),    b the angle between x and R.

Where a layer's ratio passes 1 within a step, a *secant search* finds the place. There the ratio may jump past 1, as one
object ends before another that is farther: the ray passes behind the first, and the linear search goes on. The nearest
place in any layer is what the ray meets, from whichever side. A ray that ends hidden by the first layer, and meets
nothing in the second, sees what it was last seen before; any other the environment in its own direction.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.vectors import from_to
from ldtrefl.methods.cube_maps.faces import CubeLayer, jump_allowed, look_up_surface
from ldtrefl.methods.cube_maps.impostor import EXACT, ratio_at
from ldtrefl.shading.environment import environment_radiance
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.records import LightingRecord

STEP = wp.constant(1.5)
"""Texels that a step of the linear search is long, where texels are largest."""

SAFELY_BEYOND = wp.constant(1.01)
"""Factor on the largest distance: the end of the search is behind all by more than rounding."""

SECANTS = wp.constant(4)
"""Refinements of a step, each a secant and a bisection: they leave a sixteenth of it at most."""


@wp.struct
class Meeting:
    """Where a ray meets what the layers show."""

    d: float  # distance along the ray; +inf if it meets nothing
    layer: int


@wp.func
def crossing_within(
    nearness: wp.array(dtype=float),
    resolution: int,
    start: wp.vec3,
    direction: wp.vec3,
    before: float,
    ratio_before: float,
    after: float,
    ratio_after: float,
) -> float:
    """Where a layer's ratio is 1 between two distances, whose ratios are given; +inf if it is not, or only jumps past
    1."""
    if (ratio_before < 1.0) == (ratio_after < 1.0):
        return wp.inf
    low, high = float(before), float(after)
    ratio_low, ratio_high = float(ratio_before), float(ratio_after)
    for k in range(2 * SECANTS):
        d = 0.5 * (low + high)
        if k % 2 == 0:
            d = low + (high - low) * (1.0 - ratio_low) / (ratio_high - ratio_low)
        ratio = ratio_at(nearness, resolution, start + d * direction)
        if wp.abs(ratio - 1.0) <= EXACT:
            return d
        if (ratio < 1.0) == (ratio_low < 1.0):
            low = d
            ratio_low = ratio
        else:
            high = d
            ratio_high = ratio
    if wp.abs(ratio_high - ratio_low) <= jump_allowed(resolution) * wp.min(1.0, wp.min(ratio_low, ratio_high)):
        return 0.5 * (low + high)
    return wp.inf


@wp.func
def distance_at(length: float, angle: float, turned: float) -> float:
    """The distance along a ray at which the centre sees its point turned so far from its start, of so much in all."""
    return length * wp.sin(turned) / wp.sin(angle - turned)


@wp.func
def first_meeting(
    front: CubeLayer, back: CubeLayer, resolution: int, start: wp.vec3, direction: wp.vec3, reach: float
) -> Meeting:
    """What a ray meets first. ``reach`` is the largest distance in the layers."""
    length = wp.length(start)
    angle = wp.atan2(wp.length(wp.cross(start, direction)), wp.dot(start, direction))
    steps = wp.max(int(wp.ceil(angle * float(resolution) / (2.0 * STEP))), 1)
    # Here the ray has passed all that the map shows.
    end = SAFELY_BEYOND * (reach + length)
    met = Meeting()
    met.d = wp.inf
    before, hidden = float(0.0), float(-1.0)
    front_before = ratio_at(front.nearness, resolution, start)
    back_before = ratio_at(back.nearness, resolution, start)
    for k in range(1, steps + 1):
        after = float(end)
        if k < steps:
            after = wp.min(distance_at(length, angle, angle * float(k) / float(steps)), end)
        point = start + after * direction
        front_after = ratio_at(front.nearness, resolution, point)
        back_after = ratio_at(back.nearness, resolution, point)
        met.d = crossing_within(front.nearness, resolution, start, direction, before, front_before, after, front_after)
        d = crossing_within(back.nearness, resolution, start, direction, before, back_before, after, back_after)
        if d < met.d:
            met.d = d
            met.layer = 1
        if met.d < wp.inf:
            return met
        # The ray goes on behind the first layer, or comes out from there.
        if (front_before < 1.0) != (front_after < 1.0):
            hidden = wp.where(front_before < 1.0, before, -1.0)
        if after >= end:
            break
        before = after
        front_before = front_after
        back_before = back_after
    if hidden >= 0.0 and ratio_at(front.nearness, resolution, start + hidden * direction) > 0.0:
        met.d = hidden
    return met


@launch.kernel
def reflect_layers(
    first: int,
    # In:
    rays: RayBuffer,
    reflector: int,
    front: CubeLayer,
    back: CubeLayer,
    resolution: int,
    centre: wp.vec3d,
    reach: float,
    lighting: LightingRecord,
    # Out:
    radiance_out: wp.array(dtype=wp.vec3),
):
    """Search for what one ray meets, if it leaves this reflector."""
    i = first + wp.tid()
    if rays.source[i] == reflector:
        start, direction = from_to(centre, rays.origin[i]), rays.direction[i]
        met = Meeting()
        met.d = wp.inf
        if reach > 0.0:
            met = first_meeting(front, back, resolution, start, direction, reach)
        if met.d < wp.inf:
            towards = wp.normalize(start + met.d * direction)
            if met.layer == 0:
                radiance_out[i] = look_up_surface(front, resolution, towards)
            else:
                radiance_out[i] = look_up_surface(back, resolution, towards)
        else:
            radiance_out[i] = environment_radiance(lighting, direction)
