"""Our tracers behind the interface of trimesh's ``RayMeshIntersector``."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from trimesh.ray.ray_util import contains_points

from .crossings import Crossings, Target


class RayMeshIntersector:
    """What trimesh's tests ask of ``mesh.ray``; subclasses name the tracer."""

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
        ray_origins: Any,
        ray_directions: Any,
        multiple_hits: bool = True,
        max_hits: int | None = None,
        return_locations: bool = False,
    ) -> tuple[np.ndarray, ...]:
        """Triangles and rays of all crossings, or of the first; with ``return_locations`` the points, too."""
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
        self, ray_origins: Any, ray_directions: Any, **options: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points, rays and triangles of crossings."""
        triangle, ray, points = self.intersects_id(ray_origins, ray_directions, return_locations=True, **options)
        return points, ray, triangle

    def intersects_first(self, ray_origins: Any, ray_directions: Any) -> np.ndarray:
        """(n,) first triangles, -1 on a miss."""
        return self._target().first(*_rays(ray_origins, ray_directions)).triangle

    def intersects_any(self, ray_origins: Any, ray_directions: Any) -> np.ndarray:
        """(n,) bool."""
        return self._target().occluded(*_rays(ray_origins, ray_directions), np.inf)

    def contains_points(self, points: Any) -> np.ndarray:
        """(n,) bool, by trimesh's own rule."""
        return contains_points(self, points)


def _rays(origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(origins, float), np.asarray(directions, float)


def install(by: str) -> None:
    """Put a tracer of ours in the place of both of trimesh's."""
    chosen = type("RayMeshIntersector", (RayMeshIntersector,), {"by": by})
    for module in (trimesh.ray.ray_triangle, trimesh.ray.ray_pyembree):
        module.RayMeshIntersector = chosen
