"""What a picture is of: objects as they stand upright in the world, measured for what is put around them.

Lengths around a subject are given in its own terms: ``right`` of it and ``behind`` it, as the camera of a
three-quarter view sees it (``framing.py``), and above the floor, which is under its lowest point.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import Object
from ldtrefl.scene.framing import AZIMUTH, towards
from ldtrefl.scene.layout import CORNERS, Layout
from ldtrefl.scene.tidy import decimals_for, tidy, tidy_below, tidy_point

MOST_POINTS = 4_000_000
"""Of objects with more vertices, some are measured, and the corners of their boxes: a tenth of a gigabyte."""

STEPS = 40
"""Triangles with edges longer than the size over this are measured inside, too: a ball may not stand in a wall."""

AT_ONCE = 1 << 16
"""Triangles that are measured at a time."""

SUNK = 1.0 / 2000.0
"""How far below the lowest point the floor is, as a share of the size: it must not coincide with a flat base."""

SMALLEST_SHARE = 1e-12
"""The smallest size of a subject, as a share of its largest coordinate: float64 can still tell where a camera
before it stands."""


LOWER = 0.6
"""Share of the height that counts as the lower part."""


@dataclass(frozen=True, eq=False)
class Subject:
    """Objects, measured."""

    points: np.ndarray
    """(n, 3) float64, in the world: points all over their surfaces, and all their corners."""

    @classmethod
    def of(cls, objects: Sequence[Object]) -> Subject:
        """Measure objects.

        Raises:
            InputError: there are none, one has no mesh, or all are one point.
        """
        if not objects:
            raise InputError("there is nothing to be seen: no object")
        layout = Layout.of(objects)
        count = sum(len(layout.meshes[number].vertices) for number in layout.mesh_of)
        stride = math.ceil(count / MOST_POINTS)
        placed: list[np.ndarray] = []
        for number, matrix in zip(layout.mesh_of, layout.world_from_object, strict=True):
            mesh = layout.meshes[number]
            if stride > 1:
                corners = np.where(CORNERS == 0, mesh.bounds[0], mesh.bounds[1])
                own = np.concatenate([corners, mesh.vertices[mesh.is_used][::stride]])
            else:
                own = mesh.vertices
            placed.append(np.einsum("ij,kj->ik", own, matrix[:3, :3]) + matrix[:3, 3])
        if stride > 1:
            return cls(np.concatenate(placed))
        used = [points[layout.meshes[number].is_used] for number, points in zip(layout.mesh_of, placed, strict=True)]
        box = np.array([[part.min(axis=0), part.max(axis=0)] for part in used])
        step = float((box[:, 1].max(axis=0) - box[:, 0].min(axis=0)).max()) / STEPS
        if step == 0.0:
            raise InputError("there is nothing to be seen: all is in one point")
        large = [
            _large_triangles(placed[k], layout.meshes[layout.mesh_of[k]].faces, step)
            for k in np.flatnonzero((box[:, 1] - box[:, 0]).max(axis=1) > step)
        ]
        return cls(np.concatenate([*used, *_points_inside(np.concatenate([np.empty((0, 3, 3)), *large]), step)]))

    @functools.cached_property
    def _extents(self) -> np.ndarray:
        """(2, 3) least and largest coordinates to the right, behind and up."""
        along = np.einsum("ij,kj->ik", self.points, np.array([self.right, self.behind, (0.0, 0.0, 1.0)]))
        return np.array([along.min(axis=0), along.max(axis=0)])

    @property
    def right(self) -> np.ndarray:
        """(3,) horizontal unit vector to the right in the picture."""
        return towards(AZIMUTH + 90.0, 0.0)

    @property
    def behind(self) -> np.ndarray:
        """(3,) horizontal unit vector away from the camera."""
        return -towards(AZIMUTH, 0.0)

    @property
    def width(self) -> float:
        """As the camera sees it."""
        return float(self._extents[1, 0] - self._extents[0, 0])

    @property
    def depth(self) -> float:
        """From its nearest to its farthest point, horizontally."""
        return float(self._extents[1, 1] - self._extents[0, 1])

    @property
    def height(self) -> float:
        """From its lowest to its highest point."""
        return float(self._extents[1, 2] - self._extents[0, 2])

    @functools.cached_property
    def size(self) -> float:
        """The longest of width, depth and height."""
        least = SMALLEST_SHARE * float(np.abs(self.points).max())
        return max(self.width, self.depth, self.height, least)

    @functools.cached_property
    def digits(self) -> int:
        """Decimals of coordinates around it."""
        return decimals_for(self.size)

    @functools.cached_property
    def base(self) -> np.ndarray:
        """(3,): the point of the floor under the middle of it."""
        x, y, _ = self._extents.mean(axis=0)
        across = x * self.right + y * self.behind
        floor = tidy_below(self._extents[0, 2] - SUNK * self.size, self.digits)
        return np.array([across[0], across[1], floor])

    def at(self, right: float, behind: float, up: float) -> tuple[float, float, float]:
        """A point this far to the right of the base, behind it, and above the floor."""
        point = self.base + right * self.right + behind * self.behind
        return tidy_point(np.array([point[0], point[1], self.base[2] + up]), self.digits)

    def length(self, value: float) -> float:
        """A length with as many decimals as coordinates have."""
        return tidy(value, self.digits)

    def beside(self, degrees: float, radius: float, gap: float, *, reached_over: bool) -> tuple[float, float, float]:
        """The centre of a ball that stands on the floor in a direction from the base, as near as a gap to the subject
        allows.

        The centre goes out from the base until the farthest of the places is reached where a point of the subject is
        radius + gap away.

        Args:
            degrees: the direction, from the right (0) to behind (90).
            radius: of the ball.
            gap: the distance to be kept.
            reached_over: the subject may reach over the ball; else its lower part may not (``LOWER``), so that the
                ball stands in nothing's way.
        """
        angle = np.radians(degrees)
        direction = np.cos(angle) * self.right + np.sin(angle) * self.behind
        offsets = self.points - np.add(self.base, (0.0, 0.0, radius))
        if not reached_over:
            offsets = offsets[self.points[:, 2] <= self.base[2] + LOWER * self.height] * (1.0, 1.0, 0.0)
        along = np.einsum("ij,j->i", offsets, direction)
        reach = (radius + gap) ** 2 - (np.einsum("ij,ij->i", offsets, offsets) - along**2)
        met = reach > 0.0
        distance = float((along[met] + np.sqrt(reach[met])).max(initial=radius))
        return self.at(distance * np.cos(angle), distance * np.sin(angle), radius)


def _large_triangles(vertices: np.ndarray, faces: np.ndarray, step: float) -> np.ndarray:
    """(m, 3, 3) corners of those triangles that have an edge longer than ``step``."""
    large = [np.empty((0, 3, 3))]
    for begin in range(0, len(faces), AT_ONCE):
        corners = vertices[faces[begin : begin + AT_ONCE]]
        large.append(corners[_longest_edges(corners) > step])
    return np.concatenate(large)


def _longest_edges(corners: np.ndarray) -> np.ndarray:
    """(m,) lengths, of (m, 3, 3) corners of triangles."""
    edges = corners - np.roll(corners, 1, axis=1)
    return np.sqrt(np.einsum("ijk,ijk->ij", edges, edges)).max(axis=1)


def _points_inside(corners: np.ndarray, step: float) -> list[np.ndarray]:
    """(n, 3) points on triangles, given (m, 3, 3) corners, no farther apart than ``step``, in parts.

    A triangle whose longest edge is k steps is cut in k parts along each edge. So that there are not too many points, k
    is limited by the number of triangles: to 8 for ten thousand, to 1, which is no more than the corners, for a
    million.
    """
    most = round(2 * STEPS / math.sqrt(1.0 + len(corners) / 100.0))
    parts = np.minimum(np.ceil(_longest_edges(corners) / step), most).astype(int)
    found = []
    for k in np.unique(parts[parts > 1]):
        first, second = (axis.ravel() for axis in np.meshgrid(range(k + 1), range(k + 1)))
        weights = np.stack([first, second, k - first - second], axis=1)[first + second <= k] / k
        found.append(np.einsum("wc,tcx->twx", weights, corners[parts == k]).reshape(-1, 3))
    return found
