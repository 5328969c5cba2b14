"""Distance impostors: L. Szirmay-Kalos, B. Aszodi, I. Lazanyi, M. Premecz, "Approximate Ray-Tracing on the GPU with
Distance Impostors" (Eurographics 2005).

The ray l(d) = x + d R starts at x in unit direction R, both relative to the map's centre. The map knows in the
direction of a point l how far the surface is, |l'|. The ratio |l| / |l'| is below 1 before the surface
(undershooting), above 1 behind it (overshooting), and 1 where the ray meets it. The first guess takes the surface for
a plane that is seen in the directions of x and R, at x' and r':

    d = |r'| (1 - |x| / |x'|)

As long as only undershoots are known, the same step goes on from there: d += |r'| (1 - |l| / |l'|). As soon as there
is an overshoot, too, the line between the last undershoot u and the last overshoot o says where the ratio is 1:

    d = d_u + (d_o - d_u) (1 - |l_u| / |l_u'|) / (|l_o| / |l_o'| - |l_u| / |l_u'|)

The ratio is linear along a ray before a plane, so both are exact there. The paper's map is of a closed room; here the
environment is infinitely far (ratio 0): a ray that ends before it sees the environment in its own direction. Where x
is itself behind what the map shows, the map knows nothing of its neighbourhood, and is looked up by R alone. Where the
ratio jumps past 1, at an object's edge, the search closes in on the edge: the ray passes behind the object, and the
last undershoot tells what is seen beside it.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.vectors import from_to
from ldtrefl.methods.cube_maps.faces import CubeLayer, look_near, look_up_surface
from ldtrefl.shading.environment import environment_radiance
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.records import LightingRecord

ITERATIONS = wp.constant(24)
"""Refinements at most; most rays need a few. The paper takes one to eight. Beside the environment, which its rooms do
not show, eight leave a third of the bowl's reflections torn (``scenes/bowl_mirror.toml``)."""

EXACT = wp.constant(1.0e-4)
"""A ratio that is this near to 1 is one: at 4096 texels a texel is five times as wide."""

BEYOND = wp.constant(4.0)
"""Where R points to the environment, the surface that the first guess asks for is taken to be this many times as far as
all that the map shows."""


@wp.func
def ratio_at(nearness: wp.array(dtype=float), resolution: int, point: wp.vec3) -> float:
    """|l| / |l'| of a point."""
    length = wp.length(point)
    if length == 0.0:
        return 0.0
    return length * look_near(nearness, resolution, point / length)


@wp.func
def distance_to_surface(
    nearness: wp.array(dtype=float), resolution: int, start: wp.vec3, direction: wp.vec3, reach: float
) -> float:
    """How far along a ray what the map shows is; +inf if the ray starts behind that. ``reach`` is the largest distance
    in the map."""
    step = 1.0 / wp.max(look_near(nearness, resolution, direction), 1.0 / (BEYOND * reach))
    under = float(0.0)
    ratio_under = ratio_at(nearness, resolution, start)
    if ratio_under > 1.0 + EXACT:
        return wp.inf
    over = float(-1.0)
    ratio_over = float(0.0)
    d = wp.max(step * (1.0 - ratio_under), 0.0)
    for _ in range(ITERATIONS):
        ratio = ratio_at(nearness, resolution, start + d * direction)
        if wp.abs(ratio - 1.0) <= EXACT:
            return d
        if ratio < 1.0:
            under = d
            ratio_under = ratio
        else:
            over = d
            ratio_over = ratio
        if over >= 0.0:
            d = under + (over - under) * (1.0 - ratio_under) / (ratio_over - ratio_under)
        else:
            d += step * (1.0 - ratio)
    return wp.where(over >= 0.0, under, d)


@launch.kernel
def reflect_distances(
    first: int,
    # In:
    rays: RayBuffer,
    reflector: int,
    layer: CubeLayer,
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
        seen = environment_radiance(lighting, direction)
        if reach > 0.0:
            d = distance_to_surface(layer.nearness, resolution, start, direction, reach)
            towards = wp.vec3(direction)
            if d < wp.inf:
                towards = wp.normalize(start + d * direction)
            if look_near(layer.nearness, resolution, towards) > 0.0:
                seen = look_up_surface(layer, resolution, towards)
        radiance_out[i] = seen
