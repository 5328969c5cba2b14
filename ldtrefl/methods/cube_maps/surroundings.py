"""The sphere and the box that a cube map's surroundings are taken for, measured from what the map shows.

Both are placed by *nearness*, 1 / distance: the direction that a point of the reflector sees a thing in differs from
the centre's by about their distance over the thing's. The environment's nearness is 0, so where much of it is seen, the
sphere or the box's side is far.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ldtrefl.methods.cube_maps.faces import texel_points

TEXELS_TOGETHER = 1 << 18
"""Texels that are looked at together: some arrays of them take 20 MB."""


@dataclass(frozen=True)
class Surroundings:
    """Where things stand about a cube map's centre, in device units."""

    radius: float
    """Of the sphere: 1 / radius is the mean of 1 / distance over all directions; +inf if only the environment is
    seen."""
    low: tuple[float, float, float]
    """The box's corner of least coordinates, relative to the centre; -inf at sides that are open.

    The box holds all that the map shows, and the reflector. Of the directions that leave it by one side some show
    something, a share s; the side is moved away by 1 / s. So it stays where it is in a room, and open sides are far.
    """
    high: tuple[float, float, float]
    """The opposite corner, +inf at sides that are open."""

    @classmethod
    def of(cls, nearness: np.ndarray, resolution: int, own_low: np.ndarray, own_high: np.ndarray) -> Surroundings:
        """Measure them.

        Args:
            nearness: (6 * resolution^2,) float32 of a cube map's texels, as ``faces.py`` has it.
            resolution: texels along a side of a face.
            own_low: (3,) the corner of the reflector's own box, relative to the centre.
            own_high: (3,) the opposite corner.
        """
        total, weights, low, high = 0.0, 0.0, own_low, own_high
        for points, near in _in_parts(nearness, resolution):
            square = (points * points).sum(axis=1)
            # A texel's solid angle is as 1 / distance^3 at depth 1, its nearness there as 1 / distance.
            weights += float((square**-1.5).sum())
            total += float((near / square**2).sum())
            shown = points[near > 0.0] / near[near > 0.0, None]
            if len(shown):
                low, high = np.minimum(low, shown.min(axis=0)), np.maximum(high, shown.max(axis=0))
        sides = _opened(nearness, resolution, np.stack([low, high]))
        return cls(weights / total if total > 0.0 else np.inf, tuple(sides[0].tolist()), tuple(sides[1].tolist()))


def reach_of(nearness: np.ndarray, resolution: int) -> float:
    """The largest distance from the centre, in device units, of what a layer shows; 0 if that is the environment alone.
    Its nearness is given as to :meth:`Surroundings.of`."""
    reach = 0.0
    for points, near in _in_parts(nearness, resolution):
        is_shown = near > 0.0
        distances = np.sqrt((points[is_shown] ** 2).sum(axis=1)) / near[is_shown]
        reach = max(reach, float(distances.max(initial=0.0)))
    return reach


def _opened(nearness: np.ndarray, resolution: int, box: np.ndarray) -> np.ndarray:
    """(2, 3): the corners of a box, (2, 3), its sides moved away by the share of directions that show something."""
    shown, every = np.zeros((2, 3)), np.zeros((2, 3))
    for points, near in _in_parts(nearness, resolution):
        with np.errstate(divide="ignore", invalid="ignore"):
            exits = np.where(points == 0.0, np.inf, np.where(points > 0.0, box[1], box[0]) / points)
        axis = exits.argmin(axis=1)
        side = 3 * (points[np.arange(len(axis)), axis] > 0.0) + axis
        weight = (points * points).sum(axis=1) ** -1.5
        every += np.bincount(side, weight, minlength=6).reshape(2, 3)
        shown += np.bincount(side, weight * (near > 0.0), minlength=6).reshape(2, 3)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(shown > 0.0, box * (every / shown), np.array([[-np.inf], [np.inf]]))


def _in_parts(nearness: np.ndarray, resolution: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """(n, 3) texels at depth 1 and (n,) their nearness, some rows of a face at a time."""
    step = max(1, TEXELS_TOGETHER // resolution)
    faces = nearness.reshape(6, resolution, resolution)
    for face in range(6):
        for row in range(0, resolution, step):
            near = faces[face, row : row + step]
            yield texel_points(face, resolution, row, len(near)).astype(float), near.ravel().astype(float)
