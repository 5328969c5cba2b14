"""A few triangles of a mesh: what they say of its density and its turns, before any survey (``record_choice.py``)."""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.mesh import Mesh

TRIANGLES = 1024
"""Triangles in a sample."""
LARGEST = 2.0
"""Sides of a patch across up to which a triangle is small."""
FEWEST_PAIRS = 64
"""Pairs of neighbours in the sample that tell of a surface's turns; of fewer nothing is said."""
CLOSEST = 1e-6
"""Sides of a patch that two triangles' middles are taken to lie apart at least: it is divided by."""
LARGEST_TURN = 1.0
"""Radians along a patch up to which a turn is counted: beyond that any patch is wrong."""


class Sample:
    """A few triangles of a mesh, and for each the one that follows it in the file."""

    def __init__(self, mesh: Mesh, side: float) -> None:
        """Take a sample.

        Args:
            side: of a patch, in lengths of the mesh's longest side.
        """
        self._side = 2.0 * side  # in unit space, where no area leaves float64's range
        self._mesh = mesh
        first = np.linspace(0, len(mesh.faces) - 2, TRIANGLES).astype(np.int64)
        self._faces, self._next = mesh.faces[first], mesh.faces[first + 1]
        self._corners = self._corners_of(self._faces)
        self._normal, self._area = _facet(self._corners)
        extent = (self._corners.max(axis=1) - self._corners.min(axis=1)).max(axis=1)
        self._is_small = extent <= LARGEST * self._side
        surface = float(self._area[self._is_small].sum()) / self._side**2
        self.density = np.count_nonzero(self._is_small) / surface if surface > 0.0 else 0.0
        """Small triangles per patch of their surface; 0 if they have none, as nothing can stand for them."""

    def _corners_of(self, faces: np.ndarray) -> np.ndarray:
        centre, half = self._mesh.unit_frame
        return (self._mesh.vertices[faces] - centre) / half

    def longest_edge(self) -> float:
        """The mean over the surface of the small triangles of their longest edge, in sides of a patch."""
        edges = np.linalg.norm(self._corners - np.roll(self._corners, 1, axis=1), axis=2).max(axis=1)
        return float(np.average(edges[self._is_small], weights=self._area[self._is_small])) / self._side

    def turn(self) -> float:
        """The mean square of the surface's turn along a patch, summed over both axes, radians squared.

        It is found from neighbours that follow each other in the file; 0 if too few do.
        """
        are_joined = np.count_nonzero(self._faces[:, :, None] == self._next[:, None, :], axis=(1, 2)) == 2
        are_joined &= self._is_small & (self._area > 0.0)
        if np.count_nonzero(are_joined) < FEWEST_PAIRS:
            return 0.0
        here, there = self._corners[are_joined], self._corners_of(self._next[are_joined])
        normal = self._normal[are_joined]
        other, _ = _facet(there)
        angle = np.arctan2(np.linalg.norm(np.cross(normal, other), axis=1), (normal * other).sum(axis=1))
        apart = np.linalg.norm(here.mean(axis=1) - there.mean(axis=1), axis=1)
        turn = np.minimum(angle * self._side / np.maximum(apart, self._side * CLOSEST), LARGEST_TURN)
        return 2.0 * float(np.average(turn**2, weights=self._area[are_joined]))


def _facet(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) normals, of twice the area, and (n,) areas of triangles of (n, 3, 3) corners."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normal, 0.5 * np.linalg.norm(normal, axis=1)
