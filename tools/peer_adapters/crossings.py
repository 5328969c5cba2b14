"""All crossings of a ray with a mesh, by a tracer that finds first hits: from each hit the ray is traced on.

Rays of other libraries are float64 and ours are float32, so the mesh is moved to have the middle of its box at 0.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import ldtrefl
from ldtrefl.world.unit_rays import LEAVING

AT_ONCE = 1_000_000
"""Rays traced at once, which takes some hundred megabytes."""

MOST = 1000
"""Crossings of a ray after which it is given up."""

SAME_PLACE = 8.0
"""Times ``LEAVING``, how far apart along the ray two crossings of one edge may be found."""

LEAST_LENGTH = 1e-300
"""To divide by: triangles without area have no normal."""

TRACERS: dict[str, Callable[[np.ndarray, np.ndarray], ldtrefl.LayeredDepthTexture | ldtrefl.Raycaster]] = {
    "exact": functools.partial(ldtrefl.peel, quality="exact"),
    "balanced": ldtrefl.peel,
    "bvh": ldtrefl.Raycaster,
}
"""What makes a tracer of vertices and faces, by name."""


@dataclass(frozen=True)
class Crossings:
    """(k,) crossings, those of a ray one after the other, rays in order."""

    ray: np.ndarray
    triangle: np.ndarray
    t: np.ndarray
    """float64, in lengths of the ray's direction."""
    barycentrics: np.ndarray
    """(k, 2) weights of the second and third corner."""


class Target:
    """A mesh and a tracer of it."""

    def __init__(self, by: str, vertices: np.ndarray, faces: np.ndarray) -> None:
        vertices = np.asarray(vertices, float)
        self.middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        self.mesh = ldtrefl.Mesh(vertices - self.middle, faces)
        self.tracer = TRACERS[by](self.mesh.vertices, self.mesh.faces)
        a, b, c = np.moveaxis(self.mesh.vertices[self.mesh.faces], 1, 0)
        normals = np.cross(b - a, c - a)
        self._corner, self._normals = (
            a,
            normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), LEAST_LENGTH),
        )
        self._lift = float(LEAVING) * self.mesh.unit_frame[1]

    def first(self, origins: np.ndarray, directions: np.ndarray) -> ldtrefl.Hits:
        """First hits of (n, 3) float64 rays."""
        parts = []
        for i in range(0, max(len(origins), 1), AT_ONCE):
            some = (origins[i : i + AT_ONCE] - self.middle).astype(np.float32)
            parts.append(self.tracer.trace(some, directions[i : i + AT_ONCE].astype(np.float32)))
        names = ("t", "normal", "triangle", "barycentrics")
        t, normal, triangle, barycentrics = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
        return ldtrefl.Hits(t, normal, triangle, barycentrics, sum(part.invalid for part in parts))

    def occluded(self, origins: np.ndarray, directions: np.ndarray, t_max: float) -> np.ndarray:
        """(n,) bool: whether something is met before ``t_max``."""
        some = (origins - self.middle).astype(np.float32), directions.astype(np.float32)
        return np.asarray(self.tracer.occluded(*some, t_max=t_max))

    def on_plane(self, triangle: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(n, 3) points moved into the planes of their triangles, as float32 distances leave them a little off."""
        normal = self._normals[triangle]
        height = ((points - self.middle - self._corner[triangle]) * normal).sum(axis=1, keepdims=True)
        return points - height * normal

    def crossings(self, origins: np.ndarray, directions: np.ndarray) -> Crossings:
        """Every crossing of (n, 3) float64 rays.

        From a hit a ray goes on where ``unit_rays.start_above_own`` lets rays leave a triangle, to the side that it
        goes to. What lies ``SAME_PLACE`` from there and faces the same way is the neighbour across an edge or a vertex,
        in which the ray crosses the surface once.
        """
        squared = (directions * directions).sum(axis=1)
        length = np.sqrt(squared)
        start, live = origins.copy(), np.arange(len(origins))
        t_last, side_last = np.full(len(origins), -np.inf), np.zeros(len(origins))
        found: list[tuple[np.ndarray, ...]] = []
        for _ in range(MOST):
            hits = self.first(start[live], directions[live])
            hit = hits.triangle >= 0
            live, triangle, barycentrics = live[hit], hits.triangle[hit], hits.barycentrics[hit]
            if not len(live):
                break
            way, normal = directions[live], self._normals[triangle]
            point = self.on_plane(triangle, start[live] + hits.t[hit, None].astype(float) * way)
            t = ((point - origins[live]) * way).sum(axis=1) / squared[live]
            side = np.where((normal * way).sum(axis=1) >= 0.0, 1.0, -1.0)
            near = (t - t_last[live]) * length[live] <= SAME_PLACE * self._lift
            is_new = ~(near & (side == side_last[live]))
            found.append((live[is_new], triangle[is_new], t[is_new], barycentrics[is_new]))
            t_last[live], side_last[live] = t, side
            start[live] = point + side[:, None] * self._lift * normal
        if not found:
            return Crossings(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros((0, 2)))
        ray, triangle, t, barycentrics = (np.concatenate(part) for part in zip(*found, strict=True))
        order = np.argsort(ray, kind="stable")
        return Crossings(ray[order], triangle[order], t[order], barycentrics[order])
