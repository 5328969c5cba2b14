"""Our own ray tracers: the public classes, and their kernels alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.options import Quality
from ldtrefl.ldt.searches import TRACERS
from ldtrefl.tracing.bvh import BVH
from ldtrefl.tracing.tracer import Tracer

from .common import Batch
from .ray_tracer import RayTracer
from .rays import Rays
from .rivals import MOST_TRIANGLES


class Ours(RayTracer):
    """A structure of ours over one mesh."""

    tracer: Tracer
    """What its kernels are built from."""
    built: ldtrefl.LayeredDepthTexture | ldtrefl.Raycaster
    """The public object."""
    view: object
    """What its kernels read of the mesh."""

    @classmethod
    def set_threads(cls, threads: int) -> None:
        ldtrefl.set_threads(threads)

    def takes_arrays(self, rays: Rays) -> bool:
        return self.is_default

    def closest(self, rays: Rays) -> ldtrefl.Hits:
        return self.built.trace(rays.origins, rays.directions)

    def occluded(self, rays: Rays) -> np.ndarray:
        return self.built.occluded(rays.origins, rays.directions)

    def prepared(self, rays: Rays) -> Callable[[], object]:
        """The kernel over rays that lie in Warp's arrays."""
        device, unit_frame = launch.resolve_device(None), self.built.geometry.mesh.unit_frame
        origins, directions = (wp.array(x, dtype=wp.vec3, device=device) for x in (rays.origins, rays.directions))
        return Batch(self.tracer, self.view, origins, directions, unit_frame, only_whether=rays.any_hit)

    def hits(self, rays: Rays) -> tuple[np.ndarray, np.ndarray]:
        found = self.closest(rays)
        return found.t, found.triangle


class Caster(Ours):
    """``Raycaster``: our walk down Warp's BVH."""

    name = "bvh"
    tracer = BVH

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.built = ldtrefl.Raycaster(vertices, faces)
        self.view = self.built.view()


class Peeled(Ours):
    """``peel(V, F)`` as it is by default."""

    name = "ldt"
    built: ldtrefl.LayeredDepthTexture
    quality: ClassVar[Quality] = "balanced"
    search: ClassVar[str] = "exact"

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.built = ldtrefl.peel(vertices, faces, quality=self.quality, search=self.search)
        self.tracer, self.view = TRACERS[self.search], self.built.view(self.search)

    def closest(self, rays: Rays) -> ldtrefl.Hits:
        return self.built.trace(rays.origins, rays.directions, search=self.search)

    def occluded(self, rays: Rays) -> np.ndarray:
        return self.built.occluded(rays.origins, rays.directions, search=self.search)


class Exact(Peeled):
    """Every triangle is tested."""

    name = "ldt exact"
    is_default = False
    quality = "exact"


class Fast(Peeled):
    """Texels are tested."""

    name = "ldt fast"
    is_default = False
    most_triangles = MOST_TRIANGLES
    quality = "fast"


class Linear(Peeled):
    """The paper's search."""

    name = "ldt linear"
    is_default = False
    most_triangles = MOST_TRIANGLES
    search = "linear"


OURS: tuple[type[Ours], ...] = (Peeled, Caster, Exact, Fast, Linear)
