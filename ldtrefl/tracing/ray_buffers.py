"""Rays on their way, and where they end, as arrays of all rays of a frame.

Device space; directions have unit length. Several rays may belong to one pixel: they then stand in a row, so that what
they bring can be summed in a fixed order.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np
import warp as wp

from ldtrefl.geometry.footprint import Footprint
from ldtrefl.tracing.hit import Hit

Buffer = TypeVar("Buffer")


@wp.struct
class RayBuffer:
    """Rays on their way; a ray is dead where its source is -1."""

    pixel: wp.array(dtype=wp.int32)  # to which it contributes
    origin: wp.array(dtype=wp.vec3d)
    direction: wp.array(dtype=wp.vec3)
    throughput: wp.array(dtype=wp.vec3)  # what a unit of radiance met now adds to what the ray brings
    source: wp.array(dtype=wp.int32)  # the object that it leaves
    source_triangle: wp.array(dtype=wp.int32)  # and the triangle of that object
    may_return: wp.array(dtype=wp.uint8)  # 1 if it may meet that object, too
    footprint: wp.array(dtype=Footprint)  # where it starts; empty if nothing asks for footprints


@wp.struct
class HitBuffer:
    """Where the rays of a ``RayBuffer`` end."""

    t: wp.array(dtype=float)  # device units, +inf on a miss
    object: wp.array(dtype=wp.int32)  # -1 on a miss
    triangle: wp.array(dtype=wp.int32)  # -1 on a miss
    barycentrics: wp.array(dtype=wp.vec2)  # weights of the second and third corner; below 0 if one stands for many
    steps: wp.array(dtype=wp.int32)  # texels, samples or nodes looked at
    searches: wp.array(dtype=wp.int32)  # objects that the ray was searched for in


@dataclass(frozen=True, eq=False)
class RayEnds:
    """Where rays end, and no more: what is kept of them beyond their bounce. The arrays are those of the buffers."""

    pixel: wp.array
    """(n,) int32 to which each contributes."""
    t: wp.array
    """(n,) float device units, +inf on a miss."""
    object: wp.array
    """(n,) int32, -1 on a miss."""
    triangle: wp.array
    """(n,) int32, -1 on a miss."""

    @classmethod
    def of(cls, rays: RayBuffer, hits: HitBuffer) -> RayEnds:
        """The ends of a buffer's rays."""
        return cls(rays.pixel, hits.t, hits.object, hits.triangle)

    @classmethod
    def joined(cls, parts: Sequence[RayEnds]) -> RayEnds:
        """The ends of several parts, one after another."""
        return cls(*(_joined([getattr(part, field.name) for part in parts]) for field in fields(cls)))


@wp.func
def set_miss(hits: HitBuffer, i: int):
    """Set ray ``i`` to a miss."""
    hits.t[i] = wp.inf
    hits.object[i] = -1
    hits.triangle[i] = -1
    hits.barycentrics[i] = wp.vec2(0.0)
    hits.steps[i] = 0
    hits.searches[i] = 0


@wp.func
def keep_nearer(hits: HitBuffer, i: int, k: int, t: float, hit: Hit):
    """Keep what ray ``i`` meets of object ``k``, if it is nearer than what it has met so far."""
    # Of two in one place the first counts, in whatever order they are met.
    if t < hits.t[i] or (t == hits.t[i] and k < hits.object[i]):
        hits.t[i] = t
        hits.object[i] = k
        hits.triangle[i] = hit.triangle
        hits.barycentrics[i] = wp.vec2(hit.u, hit.v)


@wp.func
def copy_hit(hits: HitBuffer, i: int, hits_out: HitBuffer, k: int):
    """Write where ray ``i`` of a buffer ends as the end of ray ``k`` of another."""
    hits_out.t[k] = hits.t[i]
    hits_out.object[k] = hits.object[i]
    hits_out.triangle[k] = hits.triangle[i]
    hits_out.barycentrics[k] = hits.barycentrics[i]
    hits_out.steps[k] = hits.steps[i]
    hits_out.searches[k] = hits.searches[i]


@wp.func
def copy_ray(rays: RayBuffer, i: int, rays_out: RayBuffer, k: int):
    """Write ray ``i`` of a buffer as ray ``k`` of another."""
    rays_out.pixel[k] = rays.pixel[i]
    rays_out.origin[k] = rays.origin[i]
    rays_out.direction[k] = rays.direction[i]
    rays_out.throughput[k] = rays.throughput[i]
    rays_out.source[k] = rays.source[i]
    rays_out.source_triangle[k] = rays.source_triangle[i]
    rays_out.may_return[k] = rays.may_return[i]
    if rays.footprint.shape[0] > 0:
        rays_out.footprint[k] = rays.footprint[i]


def empty_rays(count: int, device: wp.Device, *, carries_footprints: bool = False) -> RayBuffer:
    """A buffer for so many rays, not filled yet."""
    rays = RayBuffer()
    rays.pixel, rays.source, rays.source_triangle = (wp.empty(count, dtype=wp.int32, device=device) for _ in range(3))
    rays.origin = wp.empty(count, dtype=wp.vec3d, device=device)
    rays.direction, rays.throughput = (wp.empty(count, dtype=wp.vec3, device=device) for _ in range(2))
    rays.may_return = wp.empty(count, dtype=wp.uint8, device=device)
    rays.footprint = wp.empty(count if carries_footprints else 0, dtype=Footprint, device=device)
    return rays


def empty_hits(count: int, device: wp.Device) -> HitBuffer:
    """A buffer for the ends of so many rays, not filled yet."""
    hits = HitBuffer()
    hits.t = wp.empty(count, dtype=float, device=device)
    hits.object, hits.triangle, hits.steps, hits.searches = (
        wp.empty(count, dtype=wp.int32, device=device) for _ in range(4)
    )
    hits.barycentrics = wp.empty(count, dtype=wp.vec2, device=device)
    return hits


def cloned(kind: type[Buffer], buffer: Buffer, names: Collection[str] | None = None) -> Buffer:
    """A copy of a buffer, or of these of its arrays, the others shared; ``kind`` is its type."""
    made = kind()
    for name in _arrays_of(kind):
        array = getattr(buffer, name)
        setattr(made, name, wp.clone(array) if names is None or name in names else array)
    return made


def joined(kind: type[Buffer], buffers: Sequence[Buffer]) -> Buffer:
    """The rays of several buffers, one after another in one; ``kind`` is their type."""
    made = kind()
    for name in _arrays_of(kind):
        setattr(made, name, _joined([getattr(buffer, name) for buffer in buffers]))
    return made


def _joined(arrays: Sequence[wp.array]) -> wp.array:
    """Arrays one after another in one."""
    values = np.concatenate([array.numpy() for array in arrays])
    return wp.array(values, dtype=arrays[0].dtype, device=arrays[0].device)


def _arrays_of(kind: type) -> list[str]:
    """Names of the arrays of a Warp struct."""
    return list(kind.vars)  # type: ignore[attr-defined]


def distance_across(
    origin: np.ndarray, direction: np.ndarray, other_origin: np.ndarray, other_direction: np.ndarray, t: np.ndarray
) -> np.ndarray:
    """(n,) distance between two rays at ``t``, (n,), measured across the first's direction; vectors are (n, 3)."""
    gap = other_origin - origin + t[:, None] * (other_direction - direction)
    gap -= (gap * direction).sum(axis=1, keepdims=True) * direction
    return np.linalg.norm(gap, axis=1)
