"""First hits that depend on no tracer of ours: float64 brute force, and Embree on large meshes.

Brute force is Moeller and Trumbore 1997 on every triangle, in NumPy. On meshes of more than ``BRUTE_TRIANGLES`` the
truth is Embree in robust mode.
"""

from __future__ import annotations

import copy

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

import ldtrefl

BRUTE_TRIANGLES = 4000
"""Triangles up to which every ray is tested against every triangle."""

PAIRS_AT_ONCE = 1_000_000
"""Pairs of a ray and a triangle that are tested at once: a few hundred megabytes."""

NEAR_SLACK = 1e-6
"""By how much more than they must triangles near a ray are taken, relative and in half sides of the mesh: far beyond
the rounding of float64."""

START_DISTANCE = 2.0
"""Half sides of the mesh from its centre at which rays from farther away are started: outside its box."""


class Truth:
    """First hits on a mesh, by brute force or by Embree."""

    def __init__(self, mesh: ldtrefl.Mesh, *, always_embree: bool = False) -> None:
        self.mesh = mesh
        self.centre, self.half = mesh.unit_frame
        corners = ((mesh.vertices - self.centre) / self.half)[mesh.faces]
        self._a, self._u, self._v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        self._embree = None
        if always_embree or len(mesh.faces) > BRUTE_TRIANGLES:
            self._embree = rtcore_scene.EmbreeScene(robust=True)
            self._geometry = TriangleMesh(self._embree, mesh.unit_vertices, mesh.faces)

    @property
    def is_brute(self) -> bool:
        """Whether the answers are brute force's."""
        return self._embree is None

    def near(self, origin: np.ndarray, direction: np.ndarray, reach: float) -> Truth:
        """The truth of the triangles alone that rays within ``reach`` of a ray can meet, all parallel to it."""
        if not self.is_brute:
            return self
        o, d = (origin - self.centre) / self.half, direction / np.abs(direction).max()
        d = d / np.linalg.norm(d)
        middle = self._a + (self._u + self._v) / 3
        corners = (self._a, self._a + self._u, self._a + self._v)
        size = np.max([np.linalg.norm(corner - middle, axis=1) for corner in corners], axis=0)
        aside = middle - o
        aside = np.linalg.norm(aside - (aside @ d)[:, None] * d, axis=1)
        is_near = aside <= (1.0 + NEAR_SLACK) * (size + reach / self.half) + NEAR_SLACK
        few = copy.copy(self)
        few._a, few._u, few._v = (part[is_near] for part in (self._a, self._u, self._v))
        return few

    def hits(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """(n,) float64 distances in lengths of each direction, +inf on a miss; origins and directions (n, 3)."""
        return self.first_hits(origins, directions)[0]

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same, and (n,) triangles, -1 on a miss."""
        o = (np.asarray(origins, float) - self.centre) / self.half
        d = np.asarray(directions, float)
        length = np.abs(d).max(axis=1, keepdims=True)
        length = length * np.linalg.norm(d / length, axis=1, keepdims=True)
        d = d / length
        # Start near the object: a float32 ray tracer cannot start far away, and brute force loses nothing.
        skipped = np.maximum(-(o * d).sum(axis=1) - START_DISTANCE, 0.0)
        o = o + skipped[:, None] * d
        t, triangle = _against_all(self._a, self._u, self._v, o, d) if self.is_brute else self._by_embree(o, d)
        return (t + skipped) * self.half / length[:, 0], triangle

    def _by_embree(self, o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert self._embree is not None
        answer = self._embree.run(o.astype(np.float32), d.astype(np.float32), output=1)
        triangle = answer["primID"].astype(int)
        return np.where(triangle >= 0, answer["tfar"], np.inf).astype(float), triangle


def brute_force(mesh: ldtrefl.Mesh, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First hits of rays where they stand: (n,) distances in lengths of each direction, +inf on a miss, and (n,)
    triangles, -1 on a miss."""
    corners = mesh.vertices[mesh.faces]
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return _against_all(a, u, v, origins.astype(float), directions.astype(float))


def _against_all(
    a: np.ndarray, edge_u: np.ndarray, edge_v: np.ndarray, o: np.ndarray, d: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Every ray against every triangle, given by a corner and the edges from it."""
    t, triangle = np.full(len(o), np.inf), np.full(len(o), -1)
    if not len(a):
        return t, triangle
    step = max(1, PAIRS_AT_ONCE // len(a))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for first in range(0, len(o), step):
            rays = slice(first, first + step)
            p = np.cross(d[rays, None], edge_v)
            determinant = (p * edge_u).sum(axis=2)
            s = o[rays, None] - a
            u = (s * p).sum(axis=2) / determinant
            q = np.cross(s, edge_u)
            v = (q * d[rays, None]).sum(axis=2) / determinant
            along = (q * edge_v).sum(axis=2) / determinant
            inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (along >= 0) & np.isfinite(along)
            along = np.where(inside, along, np.inf)
            nearest = along.argmin(axis=1)
            t[rays] = along[np.arange(len(nearest)), nearest]
            triangle[rays] = np.where(np.isfinite(t[rays]), nearest, -1)
    return t, triangle
