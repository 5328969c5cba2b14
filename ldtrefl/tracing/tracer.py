"""What a tracer is: the three functions that answer rays, whatever way they search.

A *tracer* answers rays against single objects inside kernels: Warp functions over an array of *views*, one view per
object, in the object's unit space. Rays come in blocks, so that a tracer may search for them together. Kernels that
trace are built from a tracer, so everything above it (bounces, shadows, shading, counters) exists once for the layered
depth texture and for the BVH. A miss is ``t = +inf`` and triangle -1.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import warp as wp

from ldtrefl.device import warp_abi
from ldtrefl.device.stats import Stats
from ldtrefl.device.struct_arrays import copy_structs, host_structs
from ldtrefl.world.device_scene import DeviceScene

RAY_BLOCK = wp.constant(64)
"""Rays that are searched for together on the CPU: as many as a block of 8 x 8 pixels has."""


@wp.struct
class Query:
    """A ray that is searched for in an object, in its unit space: hits at ``0 <= t < t_max`` count."""

    origin: wp.vec3d
    direction: wp.vec3  # about as long as 1; t is in lengths of it
    t_max: float


@wp.func
def _as_it_starts(views: Any, index: int, query: Query, outwards: wp.vec3) -> Query:
    """``leaving`` of a tracer that finds surfaces where they are."""
    return query


@dataclass(frozen=True)
class Tracer:
    """Warp functions, and the type of the views that they read."""

    name: str
    view: type
    """The Warp struct."""
    closest_hits: Callable[..., None]
    """``closest_hits(views, index, queries, count, hits)``: the first hits of up to ``RAY_BLOCK`` rays on object
    ``index``. Of a ray that misses, t and the triangle are set."""
    any_hits: Callable[..., None]
    """``any_hits(views, index, queries, count, hits)``: whether rays meet the object at all, told by the triangle of
    each hit, which may be any triangle then."""
    occluded: Callable[..., bool]
    """``occluded(views, index, query, outwards) -> bool``: whether one ray meets the object. ``outwards`` is 0, but for
    a ray that leaves the object's own surface: it is then the unit normal there, on the ray's side, and what the tracer
    takes for that surface is not met."""
    leaving: Callable[..., Query] = _as_it_starts
    """``leaving(views, index, query, outwards) -> Query``: a ray of ``closest_hits`` that leaves the object's own
    surface, ``outwards`` as above, on its way from where it does not meet what the tracer takes for that surface. It
    already starts above its triangle."""


@dataclass(frozen=True, eq=False)
class BoundTracer:
    """A tracer, and its views of a scene's objects."""

    tracer: Tracer
    views: wp.array
    owners: Sequence[object] = ()
    """What owns the memory that the views point to."""


class SceneTracer(Protocol):
    """A tracer for all objects of a scene: makes what it needs of a mesh when that is first needed, and keeps it."""

    def bound(self, scene: DeviceScene, objects: Collection[int], stats: Stats) -> BoundTracer:
        """The tracer, ready for rays that can meet these objects, given by their numbers."""


def array_of_views(views: Sequence[object], view: type, device: wp.Device) -> wp.array:
    """Views of objects as an array that kernels read. Whoever keeps the array keeps the views, too."""
    return warp_abi.array_of_structs(views, view, device)


def array_of_shared_views(views: Sequence[object], numbers: np.ndarray, view: type, device: wp.Device) -> wp.array:
    """The same for n objects that share views: ``numbers``, (n,), are those of each object's."""
    made, copies = host_structs(len(numbers), view)
    copy_structs(array_of_views(views, view, wp.get_device("cpu")).numpy(), numbers, copies)
    return made.to(device)


def block_of(device: wp.Device) -> int:
    """Rays that one item of a kernel searches for."""
    return int(RAY_BLOCK) if device.is_cpu else 1
