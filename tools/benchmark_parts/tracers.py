"""Our own tracers with the methods that rivals have (``rivals.py``): the public classes, and their kernels alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import warp as wp

import ldtrefl
from ldtrefl import launch
from ldtrefl.grid_build import Quality
from ldtrefl.march import TRACERS
from ldtrefl.raycast import BVH
from ldtrefl.trace import Tracer

from .common import AnyHitBatch, Batch
from .rays import Rays


class Ours:
    """A structure of ours over one mesh; ``closest`` and ``occluded`` are the public calls, numpy in and numpy out."""

    name: ClassVar[str]
    tracer: Tracer
    """Of its kernels."""
    built: Any
    """The public object."""
    view: Any

    @staticmethod
    def set_threads(threads: int) -> None:
        ldtrefl.set_threads(threads)

    @property
    def nbytes(self) -> int | None:
        """Bytes beside the mesh, where the structure tells."""
        return getattr(self.built, "nbytes", None)

    @property
    def has_occluded(self) -> bool:
        """Whether the public object answers any-hit queries."""
        return hasattr(self.built, "occluded")

    def closest(self, rays: Rays) -> ldtrefl.Hits:
        return self.built.trace(rays.origins, rays.directions)

    def occluded(self, rays: Rays) -> np.ndarray:
        return self.built.occluded(rays.origins, rays.directions)

    def prepared(self, rays: Rays) -> Callable[[], Any]:
        """The kernel over rays that lie in Warp's arrays."""
        device = launch.resolve_device(None)
        arrays = (wp.array(x, dtype=wp.vec3, device=device) for x in (rays.origins, rays.directions))
        made = AnyHitBatch if rays.any_hit else Batch
        return made(self.tracer, self.view, *arrays, unit_frame=self.built.geometry.mesh.unit_frame)

    def hits(self, rays: Rays) -> tuple[np.ndarray, np.ndarray]:
        found = self.closest(rays)
        return found.t, found.triangle


class Caster(Ours):
    """``Raycaster``: Warp's BVH."""

    name = "bvh"
    tracer = BVH

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.built = ldtrefl.Raycaster(vertices, faces)
        self.view = self.built.view()


class Peeled(Ours):
    """``peel(V, F)`` as it is by default."""

    name = "ldt"
    quality: ClassVar[Quality] = "balanced"
    search: ClassVar[str] = "exact"

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.built = ldtrefl.peel(vertices, faces, quality=self.quality, search=self.search)
        self.tracer, self.view = TRACERS[self.search], self.built.view(self.search)

    def closest(self, rays: Rays) -> ldtrefl.Hits:
        return self.built.trace(rays.origins, rays.directions, search=self.search)


class Exact(Peeled):
    """Every triangle is tested."""

    name = "ldt exact"
    quality = "exact"


class Fast(Peeled):
    """Texels are tested."""

    name = "ldt fast"
    quality = "fast"


class Linear(Peeled):
    """The paper's search."""

    name = "ldt linear"
    search = "linear"
