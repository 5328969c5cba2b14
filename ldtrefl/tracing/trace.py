"""What a tracer is, and tracing a batch of rays with one.

A *tracer* answers rays against single objects inside kernels: Warp functions over an array of *views*, one view per
object. Rays come in blocks, so that a tracer may search for them together. Kernels that trace are built from a tracer,
so everything above it (bounces, shadows, shading, counters) exists once for the layered depth texture and for the BVH.

A tracer works in the object's unit space. A miss is ``t = +inf`` and triangle -1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.device import launch, warp_abi
from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.triangle import ONE_THIRD
from ldtrefl.tracing.hit import Hit
from ldtrefl.world.device_mesh import DeviceMesh

RAY_BLOCK = wp.constant(64)
"""Rays that are searched for together on the CPU: as many as a block of 8 x 8 pixels has."""


@wp.struct
class Query:
    """A ray that is searched for in an object, in its unit space: hits at ``0 <= t < t_max`` count."""

    origin: wp.vec3d
    direction: wp.vec3  # about as long as 1; t is in lengths of it
    t_max: float


@dataclass(frozen=True)
class Tracer:
    """Warp functions and the type of the views that they read.

    ``closest_hits(views, index, queries, count, hits)``: the first hits of up to ``RAY_BLOCK`` rays on object
    ``index``; of misses t and the triangle are set.
    ``any_hits``, the same: whether rays meet anything, by the triangle in ``hits``, which may be any then.
    ``occluded(views, index, query, outwards) -> bool``: whether one ray does. ``outwards`` is 0 but for a ray that
    leaves the object's own surface: it is the unit normal there, on the ray's side, and what the tracer takes for that
    surface is not met.
    ``outlier_hit(views, index, origin, direction, t_max) -> Hit``: for what lies far outside the object's bulk; the
    origin is float64 and may lie anywhere. ``outlier_count(views, index) -> int``: how much does.
    """

    name: str
    view: Any
    closest_hits: Any
    any_hits: Any
    occluded: Any
    outlier_hit: Any
    outlier_count: Any


def one_by_one(closest_hit: Any, view: Any) -> Any:
    """``closest_hits`` by a ``closest_hit(views, index, query) -> Hit``."""

    @wp.func
    def closest_hits(
        views: wp.array(dtype=view), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
    ):
        for i in range(count):
            hits[i] = closest_hit(views, index, queries[i])

    return closest_hits


def any_one_by_one(occluded: Any, view: Any) -> Any:
    """``any_hits`` by an ``occluded``."""

    @wp.func
    def any_hits(
        views: wp.array(dtype=view), index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)
    ):
        for i in range(count):
            hits[i].triangle = wp.where(occluded(views, index, queries[i], wp.vec3(0.0)), 0, -1)

    return any_hits


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
def outlier_merger(tracer: Tracer) -> Any:
    """``merge(views, index, queries, count, hits)``: what rays meet far outside the bulk counts, too."""
    outlier_hit, outlier_count = tracer.outlier_hit, tracer.outlier_count

    @wp.func
    def merge(views: Any, index: int, queries: wp.array(dtype=Query), count: int, hits: wp.array(dtype=Hit)):
        if outlier_count(views, index) > 0:
            for i in range(count):
                t_max = queries[i].t_max
                if hits[i].triangle >= 0:
                    t_max = hits[i].t
                outlier = outlier_hit(views, index, queries[i].origin, queries[i].direction, t_max)
                if outlier.triangle >= 0:
                    outlier.steps = hits[i].steps
                    hits[i] = outlier

    return merge


@launch.once
def occluded_of(tracer: Tracer) -> Any:
    """``is_blocked(views, index, query, outwards) -> bool``: the tracer's ``occluded``, outliers counted."""
    occluded, outlier_hit, outlier_count = tracer.occluded, tracer.outlier_hit, tracer.outlier_count

    @wp.func
    def is_blocked(views: Any, index: int, query: Query, outwards: wp.vec3) -> bool:
        if outlier_count(views, index) > 0:
            if outlier_hit(views, index, query.origin, query.direction, query.t_max).triangle >= 0:
                return True
        return occluded(views, index, query, outwards)

    return is_blocked


def block_of(device: wp.Device) -> int:
    """Rays that one item of a kernel searches for."""
    return int(RAY_BLOCK) if device.is_cpu else 1


FILES = ("device/vectors.h", "tracing/ray_batch.h")
"""What native functions here are made of."""

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
    """Rays from ``begin`` on in unit space, and how much longer their directions have become there; the number of
    those that are not finite or have no direction, which search for nothing."""
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
    """What the rays from ``begin`` on meet, as users get it."""
    ...


@launch.once
def batch_kernel(tracer: Tracer, block: int, only_whether: bool = False) -> wp.Kernel:
    """The kernel that traces rays given in object space, ``block`` of them an item; or that finds ``only_whether`` they
    meet anything, by the number of the triangle, which may be any then."""
    find_hits = tracer.any_hits if only_whether else tracer.closest_hits
    merge_outliers, size = outlier_merger(tracer), wp.constant(block)

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
        item = first + wp.tid()
        begin = size * item
        count = wp.min(size, origins.shape[0] - begin)
        query_room, hit_room = wp.zeros(shape=size, dtype=Query), wp.zeros(shape=size, dtype=Hit)
        scale_room = wp.zeros(shape=size, dtype=wp.float32)
        # Arrays over them, which are handed on as they are: rooms would be copied.
        queries = wp.array(ptr=query_room.ptr, shape=(size,), dtype=Query)
        hits = wp.array(ptr=hit_room.ptr, shape=(size,), dtype=Hit)
        scales = wp.array(ptr=scale_room.ptr, shape=(size,), dtype=wp.float32)
        invalid = start_queries(origins, directions, t_max, begin, count, centre, per_half, queries, scales)
        find_hits(views, 0, queries, count, hits)
        merge_outliers(views, 0, queries, count, hits)
        if t_out.shape[0] > 0:
            write_hits(hits, scales, per_half, begin, count, t_out, normal_out, triangle_out, barycentrics_out)
        else:
            for k in range(count):
                triangle_out[begin + k] = hits[k].triangle
        invalid_out[item] = invalid

    return trace_batch


def trace_batch(
    tracer: Tracer, views: wp.array, geometry: DeviceMesh, origins: Any, directions: Any, t_max: Any = None
) -> Hits:
    """Trace rays, given in the object's own coordinates, against one object.

    Args:
        origins: (..., 3) float32, a numpy or Warp array.
        directions: (..., 3) float32, any length.
        t_max: hits before this count, in lengths of the direction; a number, or (...), one a ray; ``None``: all.

    Raises:
        InputError: the arrays' shapes do not fit, or they hold no numbers.
    """
    rays = _Rays(origins, directions, t_max, geometry.vertices.device)
    hits = _traced(tracer, views, geometry.mesh.unit_frame, rays)
    if isinstance(origins, wp.array):
        return hits
    shape = rays.shape
    return Hits(
        hits.t.numpy().reshape(shape),
        hits.normal.numpy().reshape(*shape, 3),
        hits.triangle.numpy().reshape(shape),
        hits.barycentrics.numpy().reshape(*shape, 2),
        hits.invalid,
    )


def trace_in_unit_space(tracer: Tracer, views: wp.array, origins: wp.array, directions: wp.array) -> Hits:
    """:func:`trace_batch` for Warp arrays of rays in the object's unit space."""
    return _traced(tracer, views, (np.zeros(3), 1.0), _Rays(origins, directions, None, origins.device))


def occluded_batch(
    tracer: Tracer, views: wp.array, geometry: DeviceMesh, origins: Any, directions: Any, t_max: Any = None
) -> Any:
    """Whether rays meet an object at all; arguments and errors as :func:`trace_batch` has them.

    Returns:
        (...) bool; for Warp arrays (n,) int32, below 0 where nothing is met.
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

    def __init__(self, origins: Any, directions: Any, t_max: Any, device: wp.Device) -> None:
        self.origins, self.shape = _ray_array(origins, "origins", device)
        self.directions, other = _ray_array(directions, "directions", device)
        if self.shape != other:
            raise InputError(f"origins of shape {(*self.shape, 3)} for directions of shape {(*other, 3)}")
        self.count = self.origins.shape[0]
        self.t_max = _limits(t_max, self.shape, device)


def _traced(tracer: Tracer, views: wp.array, unit_frame: tuple[np.ndarray, float], rays: _Rays) -> Hits:
    n, device = rays.count, rays.origins.device
    t, triangle = wp.empty(n, dtype=float, device=device), wp.empty(n, dtype=int, device=device)
    normal, barycentrics = wp.empty(n, dtype=wp.vec3, device=device), wp.empty(n, dtype=wp.vec2, device=device)
    invalid = _launch_batch(tracer, views, unit_frame, rays, [t, normal, triangle, barycentrics])
    return Hits(t, normal, triangle, barycentrics, invalid)


def _launch_batch(
    tracer: Tracer,
    views: wp.array,
    unit_frame: tuple[np.ndarray, float],
    rays: _Rays,
    outputs: list[wp.array],
    *,
    only_whether: bool = False,
) -> int:
    """Trace rays; the number of those that are invalid. The ``unit_frame`` is (0, 1) if they are in unit space."""
    device, (centre, half) = rays.origins.device, unit_frame
    block = block_of(device)
    items = -(-rays.count // block)
    invalid = wp.empty(items, dtype=int, device=device)
    inputs = [views, wp.vec3d(*centre), wp.float64(1.0 / half), rays.origins, rays.directions, rays.t_max]
    launch.launch(batch_kernel(tracer, block, only_whether), items, [*inputs, *outputs, invalid], device)
    return int(invalid.numpy().sum())


def _limits(t_max: Any, shape: tuple[int, ...], device: wp.Device) -> wp.array:
    """(n,), (1,) or, where there are none, (0,) float32."""
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


def _ray_array(rays: Any, name: str, device: wp.Device) -> tuple[wp.array, tuple[int, ...]]:
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
