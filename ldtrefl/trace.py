"""What a tracer is, and tracing a batch of rays with one.

A *tracer* answers single rays against single objects inside kernels: ``closest_hit`` and ``occluded``, two Warp
functions over an array of *views*, one view per object. Kernels that trace are built from a tracer, so everything
above it (bounces, shadows, shading, counters) exists once for the layered depth texture and for the BVH.

A tracer works in the object's unit space, with unit directions. A miss is ``t = +inf`` and triangle -1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl import launch, warp_abi
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.errors import InputError
from ldtrefl.hit import Hit, no_hit
from ldtrefl.shade import ONE_THIRD
from ldtrefl.unit_rays import aimed_start, distance_skipped, is_near, skipped_to
from ldtrefl.vectors import as_single

SHORTEST = wp.constant(1.0e-15)
LONGEST = wp.constant(1.0e15)
"""Lengths of directions whose squares stay well inside float32's range."""


@wp.func
def is_number(x: float) -> bool:
    """Whether x is finite: a comparison, where ``wp.isfinite`` is a call into the C library."""
    return wp.abs(x) < wp.inf


@dataclass(frozen=True)
class Tracer:
    """A pair of Warp functions and the type of the views that they read.

    ``closest_hit(views, index, origin, direction, t_max) -> Hit`` and ``occluded(views, index, origin, direction,
    t_max, outwards) -> bool``: object ``index``, its unit space, unit direction, hits at ``0 <= t < t_max``. Origins
    are near the object, see ``unit_rays.py``. ``outwards`` is 0 but for a ray that leaves the object's own surface: it
    is the unit normal there, on the ray's side, and what the tracer takes for that surface is not met.
    ``stray_hit(views, index, origin, direction, t_max) -> Hit``: the same for what lies far outside the object's
    bulk; the origin is float64 and may lie anywhere. ``stray_count(views, index) -> int``: how much does.
    """

    name: str
    view: Any
    closest_hit: Any
    occluded: Any
    stray_hit: Any
    stray_count: Any


@dataclass(frozen=True)
class Hits:
    """Answers to a batch of n rays, as numpy arrays if the rays were, else as Warp arrays."""

    t: Any
    """(n,) float32, in lengths of each ray's direction; +inf on a miss."""
    normal: Any
    """(n, 3) float32 unit facet normal by the triangle's winding; 0 on a miss."""
    triangle: Any
    """(n,) int32; -1 on a miss."""
    barycentrics: Any
    """(n, 2) float32 weights of the triangle's second and third corner."""
    invalid: int
    """Rays that were not finite or had no direction; they count as misses."""


def array_of_views(views: Sequence[Any], view: Any, device: wp.Device) -> wp.array:
    """Views of objects as an array that kernels read. Whoever keeps the array keeps the views, too."""
    return warp_abi.array_of_structs(views, view, device)


@launch.once
def closest_hit_of(tracer: Tracer) -> Any:
    """``closest(views, index, start, direction, way, t_max) -> Hit`` for rays from anywhere.

    ``start`` is in the unit space of object ``index``, float64; ``way`` is the unit vector of ``direction``, which is
    as exact as it was given; t and ``t_max`` are in unit space.
    """
    closest_hit, stray_hit, stray_count = tracer.closest_hit, tracer.stray_hit, tracer.stray_count

    @wp.func
    def closest(views: Any, index: int, start: wp.vec3d, direction: wp.vec3, way: wp.vec3, t_max: float) -> Hit:
        origin = as_single(start)
        skipped = wp.float64(0.0)
        limit = t_max
        stray = no_hit()
        if not is_near(origin) or stray_count(views, index) > 0:
            aimed = aimed_start(start, direction, way)
            stray = stray_hit(views, index, aimed, way, t_max)
            skipped = distance_skipped(aimed, way)
            limit = float(wp.float64(wp.min(stray.t, t_max)) - skipped)
            origin = skipped_to(aimed, way, skipped)
        hit = no_hit()
        if limit > 0.0:
            hit = closest_hit(views, index, origin, way, limit)
        if skipped > wp.float64(0.0):
            hit.t = float(wp.float64(hit.t) + skipped)
        if hit.triangle < 0 and stray.triangle >= 0:
            return stray
        return hit

    return closest


@launch.once
def occluded_of(tracer: Tracer) -> Any:
    """``is_blocked(views, index, start, way, t_max, outwards) -> bool`` for rays from anywhere, see
    :func:`closest_hit_of`."""
    occluded, stray_hit, stray_count = tracer.occluded, tracer.stray_hit, tracer.stray_count

    @wp.func
    def is_blocked(views: Any, index: int, start: wp.vec3d, way: wp.vec3, t_max: float, outwards: wp.vec3) -> bool:
        origin = as_single(start)
        limit = t_max
        if not is_near(origin) or stray_count(views, index) > 0:
            if stray_hit(views, index, start, way, t_max).triangle >= 0:
                return True
            skipped = distance_skipped(start, way)
            limit = float(wp.float64(t_max) - skipped)
            origin = skipped_to(start, way, skipped)
        return limit > 0.0 and occluded(views, index, origin, way, limit, outwards)

    return is_blocked


@launch.once
def batch_kernel(tracer: Tracer) -> wp.Kernel:
    """The kernel that traces rays given in object space."""
    closest = closest_hit_of(tracer)

    @launch.kernel
    def trace_batch(
        first: int,
        # In:
        views: wp.array(dtype=tracer.view),
        centre: wp.vec3d,
        per_half: wp.float64,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        # Out:
        t_out: wp.array(dtype=float),
        normal_out: wp.array(dtype=wp.vec3),
        triangle_out: wp.array(dtype=int),
        barycentrics_out: wp.array(dtype=wp.vec2),
        invalid_out: wp.array(dtype=wp.uint8),
    ):
        i = first + wp.tid()
        origin = origins[i]
        direction = directions[i]
        hit = no_hit()
        normal = wp.vec3(0.0)
        length = wp.length(direction)
        if length < SHORTEST or length > LONGEST:
            # Its square may have left float32's range.
            largest = wp.max(wp.abs(direction[0]), wp.max(wp.abs(direction[1]), wp.abs(direction[2])))
            length = largest * wp.length(direction / largest)
        is_valid = is_number(origin[0]) and is_number(origin[1]) and is_number(origin[2]) and is_number(length)
        if is_valid and length > 0.0:
            # Shift and scale in float64: the object may be tiny and far from its origin.
            start = per_half * wp.vec3d(
                wp.float64(origin[0]) - centre[0], wp.float64(origin[1]) - centre[1], wp.float64(origin[2]) - centre[2]
            )
            way = direction / length
            hit = closest(views, 0, start, direction, way, float(wp.inf))
            if hit.triangle >= 0:
                hit.t = float(wp.float64(hit.t) / (per_half * wp.float64(length)))
                normal = hit.normal
                if hit.u < 0.0:
                    hit.u = ONE_THIRD
                    hit.v = ONE_THIRD
        else:
            invalid_out[i] = wp.uint8(1)
        t_out[i] = hit.t
        normal_out[i] = normal
        triangle_out[i] = hit.triangle
        barycentrics_out[i] = wp.vec2(hit.u, hit.v)

    return trace_batch


def trace_batch(tracer: Tracer, views: wp.array, geometry: DeviceMesh, origins: Any, directions: Any) -> Hits:
    """Trace n rays, given in the object's own coordinates, against one object.

    Args:
        origins: (n, 3) float32, a numpy or Warp array.
        directions: (n, 3) float32, any length.

    Raises:
        InputError: the arrays' shapes are not (n, 3) and equal.
    """
    as_warp = isinstance(origins, wp.array)
    device = geometry.vertices.device
    starts, ways = (_ray_array(rays, name, device) for rays, name in ((origins, "origins"), (directions, "directions")))
    if starts.shape != ways.shape:
        raise InputError(f"{starts.shape[0]} origins for {ways.shape[0]} directions")
    hits = trace_rays(tracer, views, geometry.mesh.unit_frame, starts, ways)
    if as_warp:
        return hits
    return Hits(hits.t.numpy(), hits.normal.numpy(), hits.triangle.numpy(), hits.barycentrics.numpy(), hits.invalid)


def trace_rays(
    tracer: Tracer, views: wp.array, unit_frame: tuple[np.ndarray, float], origins: wp.array, directions: wp.array
) -> Hits:
    """:func:`trace_batch` for Warp arrays, with the ``unit_frame`` of the rays: (0, 1) if they are in unit space."""
    n, device = origins.shape[0], origins.device
    centre, half = unit_frame
    t, triangle = wp.empty(n, dtype=float, device=device), wp.empty(n, dtype=int, device=device)
    normal, barycentrics = wp.empty(n, dtype=wp.vec3, device=device), wp.empty(n, dtype=wp.vec2, device=device)
    invalid = wp.zeros(n, dtype=wp.uint8, device=device)
    inputs = [views, wp.vec3d(*centre), wp.float64(1.0 / half), origins, directions]
    launch.launch(batch_kernel(tracer), n, [*inputs, t, normal, triangle, barycentrics, invalid], device)
    return Hits(t, normal, triangle, barycentrics, int(np.count_nonzero(invalid.numpy())))


def _ray_array(rays: Any, name: str, device: wp.Device) -> wp.array:
    if isinstance(rays, wp.array):
        if rays.dtype is wp.vec3 and rays.ndim == 1:
            return rays.to(device)
        rays = rays.numpy()
    try:
        with np.errstate(over="ignore"):  # too large for float32 is infinite: a ray that counts as invalid
            array = np.ascontiguousarray(rays, np.float32)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers of shape (n, 3)") from error
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name} must have shape (n, 3), got {array.shape}")
    return wp.array(array, dtype=wp.vec3, device=device, copy=False)  # on the CPU they are only read where they lie
