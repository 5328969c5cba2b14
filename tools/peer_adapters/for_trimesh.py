"""Our tracers behind the interface of trimesh's ``RayMeshIntersector``."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import ArrayLike
from trimesh.ray.ray_util import contains_points

from .crossings import Crossings, Target


class RayMeshIntersector:
    """The part of ``mesh.ray`` that trimesh's tests use; subclasses name the tracer."""

    by = "exact"

    def __init__(self, mesh: trimesh.Trimesh, scale_to_box: bool = True) -> None:
        self.mesh = mesh
        self._made: tuple[int, Target] | None = None

    def _target(self) -> Target:
        # The mesh may have been changed since.
        content = hash(self.mesh)
        if self._made is None or self._made[0] != content:
            self._made = content, Target(self.by, self.mesh.vertices, self.mesh.faces)
        return self._made[1]

    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int | None = None,
        return_locations: bool = False,
    ) -> tuple[np.ndarray, ...]:
        """(k,) triangles and rays of all crossings, or of each ray's first; with ``return_locations`` points, too."""
        origins, directions = _rays(ray_origins, ray_directions)
        target = self._target()
        if multiple_hits:
            found = target.crossings(origins, directions)
        else:
            hits = target.first(origins, directions)
            ray = np.flatnonzero(hits.triangle >= 0)
            found = Crossings(ray, hits.triangle[ray].astype(int), hits.t[ray].astype(float), hits.barycentrics[ray])
        if not return_locations:
            return found.triangle, found.ray
        points = origins[found.ray] + found.t[:, None] * directions[found.ray]
        return found.triangle, found.ray, target.on_plane(found.triangle, points)

    def intersects_location(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(k, 3) points, (k,) rays and triangles of crossings."""
        triangle, ray, points = self.intersects_id(ray_origins, ray_directions, multiple_hits, max_hits, True)
        return points, ray, triangle

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> np.ndarray:
        """(n,) the triangle that each ray meets first, -1 on a miss."""
        return self._target().first(*_rays(ray_origins, ray_directions)).triangle

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> np.ndarray:
        """(n,) bool: whether each ray meets anything."""
        return self._target().occluded(*_rays(ray_origins, ray_directions), np.inf)

    def contains_points(self, points: ArrayLike) -> np.ndarray:
        """(n,) bool: whether points lie inside, by trimesh's own rule."""
        return contains_points(self, points)


def _rays(origins: ArrayLike, directions: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(origins, float), np.asarray(directions, float)


def install(by: str) -> None:
    """Put a tracer of ours in the place of both of trimesh's."""
    chosen = type("RayMeshIntersector", (RayMeshIntersector,), {"by": by})
    for module in (trimesh.ray.ray_triangle, trimesh.ray.ray_pyembree):
        module.RayMeshIntersector = chosen
