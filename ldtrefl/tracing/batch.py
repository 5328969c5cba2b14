"""Batches of rays against one object, as users of the library ask for them.

Rays are given in the object's own coordinates, with directions of any length. They are brought into its unit space,
searched for in blocks, and the answers brought back.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.triangle import ONE_THIRD
from ldtrefl.tracing.hit import Hit
from ldtrefl.tracing.tracer import Query, Tracer, block_of
from ldtrefl.world.device_mesh import DeviceMesh

RayArray = ArrayLike | wp.array
"""Numbers of shape (..., 3), or a Warp array of them."""


@dataclass(frozen=True)
class Hits:
    """Answers to a batch of rays of shape (..., 3): numpy arrays, or Warp arrays if the rays were given as such."""

    t: np.ndarray | wp.array
    """(...) float32, in lengths of each ray's direction; +inf on a miss."""
    normal: np.ndarray | wp.array
    """(..., 3) float32 unit facet normal by the triangle's winding; 0 on a miss."""
    triangle: np.ndarray | wp.array
    """(...) int32; -1 on a miss."""
    barycentrics: np.ndarray | wp.array
    """(..., 2) float32 weights of the triangle's second and third corner."""
    invalid: int
    """Rays that were not finite or had no direction; they count as misses."""


FILES = ("device/vectors.h", "tracing/ray_query.h", "tracing/ray_batch.h")
"""The headers that the native functions of this file include."""

START = """
    static_assert(sizeof(queries.data[0]) == sizeof(RayBatch::Query), "a Query as it is here");
    const int limits = t_max.shape[0];
    int invalid = 0;
    for (int k = 0; k < count; ++k) {
        const int i = begin + k;
        const float end = limits == 0 ? INFINITY : t_max.data[limits > 1 ? i : 0];
        const float scale = RayBatch::start(
            ((RayBatch::Query*)queries.data)[k], &origins.data[i][0], &directions.data[i][0], end, &centre[0], per_half
        );
        scales.data[k] = scale;
        invalid += scale > 0.0f ? 0 : 1;
    }
    return invalid;
"""


@wp.func_native(native_body({}, FILES, START))
def start_queries(
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    t_max: wp.array(dtype=float),
    begin: int,
    count: int,
    centre: wp.vec3d,
    per_half: wp.float64,
    queries: wp.array(dtype=Query),
    scales: wp.array(dtype=float),
) -> wp.int32:
    """Bring ``count`` rays from number ``begin`` on into unit space, and write how much longer their directions are
    there. Returns how many of them are not finite or have no direction; those meet nothing."""
    ...


FINISH = """
    for (int k = 0; k < count; ++k) {
        auto& hit = hits.data[k];
        const int i = begin + k;
        const bool is_met = hit.triangle >= 0, is_known = hit.u >= 0.0f;
        triangle.data[i] = hit.triangle;
        t.data[i] = is_met ? (float)(hit.t * (scales.data[k] / per_half)) : INFINITY;
        barycentrics.data[i][0] = !is_met ? 0.0f : is_known ? hit.u : ONE_THIRD;
        barycentrics.data[i][1] = !is_met ? 0.0f : is_known ? hit.v : ONE_THIRD;
        for (int axis = 0; axis < 3; ++axis) normal.data[i][axis] = is_met ? hit.normal[axis] : 0.0f;
    }
"""


@wp.func_native(native_body({"ONE_THIRD": float(ONE_THIRD)}, (), FINISH))
def write_hits(
    hits: wp.array(dtype=Hit),
    scales: wp.array(dtype=float),
    per_half: wp.float64,
    begin: int,
    count: int,
    t: wp.array(dtype=float),
    normal: wp.array(dtype=wp.vec3),
    triangle: wp.array(dtype=int),
    barycentrics: wp.array(dtype=wp.vec2),
):
    """Write what the rays from number ``begin`` on meet, in the form in which users get it."""
    ...


@launch.once
def batch_kernel(tracer: Tracer, block: int, only_whether: bool = False) -> wp.Kernel:
    """The kernel that traces rays given in object space; one item of it traces ``block`` rays.

    With ``only_whether`` it finds no more than whether each ray meets anything. The triangle's number tells that: it is
    -1 on a miss, and may be any triangle's on a hit.
    """
    find_hits = tracer.any_hits if only_whether else tracer.closest_hits
    size = wp.constant(block)

    @launch.kernel
    def trace_batch(
        first: int,
        # In:
        views: wp.array(dtype=tracer.view),
        centre: wp.vec3d,
        per_half: wp.float64,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        t_max: wp.array(dtype=float),  # of each ray, or one for all; empty: without end
        # Out:
        t_out: wp.array(dtype=float),
        normal_out: wp.array(dtype=wp.vec3),
        triangle_out: wp.array(dtype=int),
        barycentrics_out: wp.array(dtype=wp.vec2),
        invalid_out: wp.array(dtype=int),  # rays of the block that are not finite or have no direction
    ):
        """Trace one block of rays."""
        item = first + wp.tid()
        begin = size * item
        count = wp.min(size, origins.shape[0] - begin)
        query_memory, hit_memory = wp.zeros(shape=size, dtype=Query), wp.zeros(shape=size, dtype=Hit)
        scale_memory = wp.zeros(shape=size, dtype=wp.float32)
        # Arrays over that memory: functions are handed arrays by reference, but copies of what ``wp.zeros`` gives.
        queries = wp.array(ptr=query_memory.ptr, shape=(size,), dtype=Query)
        hits = wp.array(ptr=hit_memory.ptr, shape=(size,), dtype=Hit)
        scales = wp.array(ptr=scale_memory.ptr, shape=(size,), dtype=wp.float32)
        invalid = start_queries(origins, directions, t_max, begin, count, centre, per_half, queries, scales)
        find_hits(views, 0, queries, count, hits)
        if t_out.shape[0] > 0:
            write_hits(hits, scales, per_half, begin, count, t_out, normal_out, triangle_out, barycentrics_out)
        else:
            for k in range(count):
                triangle_out[begin + k] = hits[k].triangle
        invalid_out[item] = invalid

    return trace_batch


def trace_batch(
    tracer: Tracer,
    views: wp.array,
    geometry: DeviceMesh,
    origins: RayArray,
    directions: RayArray,
    t_max: RayArray | None = None,
) -> Hits:
    """Trace rays, given in the object's own coordinates, against one object.

    Args:
        origins: (..., 3) float32, a numpy or Warp array.
        directions: (..., 3) float32, any length.
        t_max: hits count only before this distance, in lengths of the direction: one number for all rays, or (...),
            one for each; ``None`` for no limit.

    Raises:
        InputError: the arrays' shapes do not fit, or they hold no numbers.
    """
    rays = _Rays(origins, directions, t_max, geometry.vertices.device)
    found = _traced(tracer, views, geometry.mesh.unit_frame, rays)
    if isinstance(origins, wp.array):
        return Hits(*found.arrays, found.invalid)
    t, normal, triangle, barycentrics = (array.numpy() for array in found.arrays)
    shape = rays.shape
    return Hits(
        t.reshape(shape),
        normal.reshape(*shape, 3),
        triangle.reshape(shape),
        barycentrics.reshape(*shape, 2),
        found.invalid,
    )


def trace_in_unit_space(tracer: Tracer, views: wp.array, origins: wp.array, directions: wp.array) -> Hits:
    """:func:`trace_batch` for Warp arrays of rays in the object's unit space; the answers are numpy arrays."""
    found = _traced(tracer, views, (np.zeros(3), 1.0), _Rays(origins, directions, None, origins.device))
    t, normal, triangle, barycentrics = (array.numpy() for array in found.arrays)
    return Hits(t, normal, triangle, barycentrics, found.invalid)


def occluded_batch(
    tracer: Tracer,
    views: wp.array,
    geometry: DeviceMesh,
    origins: RayArray,
    directions: RayArray,
    t_max: RayArray | None = None,
) -> np.ndarray | wp.array:
    """Whether rays meet an object at all. Arguments and errors are those of :func:`trace_batch`.

    Returns:
        (...) bool; if the rays are Warp arrays, an (n,) int32 Warp array, below 0 where nothing is met.
    """
    device = geometry.vertices.device
    rays = _Rays(origins, directions, t_max, device)
    triangle = wp.empty(rays.count, dtype=int, device=device)
    none, nowhere = wp.empty(0, dtype=float, device=device), wp.empty(0, dtype=wp.vec3, device=device)
    outputs = [none, nowhere, triangle, wp.empty(0, dtype=wp.vec2, device=device)]
    _launch_batch(tracer, views, geometry.mesh.unit_frame, rays, outputs, only_whether=True)
    return triangle if isinstance(origins, wp.array) else (triangle.numpy() >= 0).reshape(rays.shape)


class _Rays:
    """Rays as a user gives them, on a device."""

    def __init__(self, origins: RayArray, directions: RayArray, t_max: RayArray | None, device: wp.Device) -> None:
        self.origins, self.shape = _ray_array(origins, "origins", device)
        self.directions, other = _ray_array(directions, "directions", device)
        if self.shape != other:
            raise InputError(f"origins of shape {(*self.shape, 3)} for directions of shape {(*other, 3)}")
        self.count = self.origins.shape[0]
        self.t_max = _limits(t_max, self.shape, device)


@dataclass(frozen=True)
class _Found:
    """Answers to rays, on their device."""

    arrays: tuple[wp.array, wp.array, wp.array, wp.array]
    """t, normal, triangle and barycentrics, as in ``Hits``."""
    invalid: int


def _traced(tracer: Tracer, views: wp.array, unit_frame: tuple[np.ndarray, float], rays: _Rays) -> _Found:
    n, device = rays.count, rays.origins.device
    t, triangle = wp.empty(n, dtype=float, device=device), wp.empty(n, dtype=int, device=device)
    normal, barycentrics = wp.empty(n, dtype=wp.vec3, device=device), wp.empty(n, dtype=wp.vec2, device=device)
    invalid = _launch_batch(tracer, views, unit_frame, rays, [t, normal, triangle, barycentrics])
    return _Found((t, normal, triangle, barycentrics), invalid)


def _launch_batch(
    tracer: Tracer,
    views: wp.array,
    unit_frame: tuple[np.ndarray, float],
    rays: _Rays,
    outputs: list[wp.array],
    *,
    only_whether: bool = False,
) -> int:
    """Trace rays, and return how many of them are invalid. ``unit_frame`` is the centre of the object's bounding box
    and half its longest side; (0, 1) for rays that are in unit space."""
    device, (centre, half) = rays.origins.device, unit_frame
    block = block_of(device)
    items = -(-rays.count // block)
    invalid = wp.empty(items, dtype=int, device=device)
    inputs = [views, wp.vec3d(*centre), wp.float64(1.0 / half), rays.origins, rays.directions, rays.t_max]
    launch.launch(batch_kernel(tracer, block, only_whether), items, [*inputs, *outputs, invalid], device)
    return int(invalid.numpy().sum())


def _limits(t_max: RayArray | None, shape: tuple[int, ...], device: wp.Device) -> wp.array:
    """``t_max`` on the device, float32: (n,) with one limit a ray, (1,) with one for all, (0,) without any."""
    if t_max is None:
        return wp.empty(0, dtype=float, device=device)
    if isinstance(t_max, wp.array):
        t_max = t_max.numpy()
    try:
        with np.errstate(over="ignore"):
            limits = np.asarray(t_max, np.float32)
        if limits.ndim > 0:
            limits = np.ascontiguousarray(np.broadcast_to(limits, shape))
    except (TypeError, ValueError) as error:
        raise InputError(f"t_max must be a number, or numbers of shape {shape}") from error
    return wp.array(limits.reshape(-1), dtype=float, device=device)


def _ray_array(rays: RayArray, name: str, device: wp.Device) -> tuple[wp.array, tuple[int, ...]]:
    """(n,) vec3 on the device, and the shape that the rays were given in, without their coordinates."""
    if isinstance(rays, wp.array):
        if rays.dtype is wp.vec3 and rays.ndim == 1:
            return rays.to(device), rays.shape
        rays = rays.numpy()
    try:
        with np.errstate(over="ignore"):  # too large for float32 is infinite: a ray that counts as invalid
            array = np.ascontiguousarray(rays, np.float32)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers of shape (..., 3)") from error
    if array.ndim < 1 or array.shape[-1] != 3:
        raise InputError(f"{name} must have shape (..., 3), got {array.shape}")
    shape = array.shape[:-1]
    flat = array.reshape(-1, 3)
    return wp.array(flat, dtype=wp.vec3, device=device, copy=False), shape  # on the CPU they are read where they lie
