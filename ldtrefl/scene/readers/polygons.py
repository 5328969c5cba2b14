"""Polygons -> triangles, in the order of the polygons, each with its winding.

A convex polygon is cut from its first corner, (0, 1, 2), (0, 2, 3) and so on, a four-sided one into (0, 1, 2) and
(2, 3, 0). One with a corner that points inwards is cut in the plane that fits it best, so that its area is right. A
polygon of n corners always gives n - 2 triangles that use all of its corners: what was closed stays closed.
"""

from __future__ import annotations

import mapbox_earcut
import numpy as np

from ldtrefl.base.errors import InputError

SMALLEST_REFLEX = 1e-6
"""Sine of a turn the wrong way from which a corner points inwards: what float32 does to a straight line is less."""

BLOCK = 1 << 18
"""Corners of polygons that are cut at a time."""

MOST_WORK = 1 << 28
"""The sum of the squares of the corners of all polygons of more than four that are not convex: the time to cut one can
grow so, and then this takes ten seconds."""


def triangles_of(points: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Cut polygons into triangles.

    Args:
        points: (corners, 3), the corners of one polygon after another.
        sizes: (polygons,) corners of each, at least 3.

    Returns:
        (triangles, 3) int64, numbers of corners.

    Raises:
        InputError: polygons that are not convex have too many corners.
    """
    if (sizes == 3).all():
        return np.arange(3 * len(sizes)).reshape(-1, 3)
    starts = np.cumsum(sizes) - sizes
    firsts = np.cumsum(sizes - 2) - (sizes - 2)
    work = 0
    result = np.empty((int((sizes - 2).sum()), 3), np.int64)
    for size in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == size)
        for block in np.array_split(alike, -(-len(alike) * size // BLOCK)):
            cuts = np.tile(_fan(size), (len(block), 1, 1))
            if size > 3:
                work += size**2 * _cut_concave(cuts, points[starts[block, None] + np.arange(size)], MOST_WORK - work)
            result[firsts[block, None] + np.arange(size - 2)] = starts[block, None, None] + cuts
    return result


def _fan(size: int) -> np.ndarray:
    """(size - 2, 3): how a convex polygon is cut."""
    if size == 4:
        return np.array([[0, 1, 2], [2, 3, 0]])
    return np.stack([np.zeros(size - 2, np.int64), np.arange(1, size - 1), np.arange(2, size)], 1)


def _cut_concave(cuts: np.ndarray, points: np.ndarray, allowed: int) -> int:
    """Cut polygons that have a corner which points inwards anew.

    Args:
        cuts: (p, n - 2, 3), the triangles of each polygon, to be changed.
        points: (p, n, 3), the polygons.
        allowed: the largest sum of the squares of their corners.

    Returns:
        How many polygons of more than four corners were cut anew.
    """
    arriving = points - np.roll(points, 1, axis=1)
    leaving = np.roll(arriving, -1, axis=1)
    # Newell's normal; from the first corner, so that a polygon far from the origin keeps its digits.
    out = points - points[:, :1]
    normal = np.cross(out, np.roll(out, -1, axis=1)).sum(axis=1)
    turns = np.einsum("pni,pi->pn", np.cross(arriving, leaving), normal)
    lengths = np.linalg.norm(arriving, axis=2)
    scales = lengths * np.roll(lengths, -1, axis=1) * np.linalg.norm(normal, axis=1, keepdims=True)
    is_reflex = turns < -SMALLEST_REFLEX * scales
    concave = np.flatnonzero(is_reflex.any(axis=1))
    if points.shape[1] == 4:
        # The cut starts at the corner that points inwards.
        points_in_at_odd = concave[~is_reflex[concave][:, ::2].any(axis=1)]
        cuts[points_in_at_odd] = [[1, 2, 3], [3, 0, 1]]
        return 0
    if len(concave) * points.shape[1] ** 2 > allowed:
        raise InputError(
            f"polygons that are not convex have too many corners, {points.shape[1]} and more "
            f"(the sum of their squares may be {MOST_WORK})"
        )
    for k in concave:
        cut = _earcut(_flattened(out[k], normal[k]))
        if cut is not None:
            cuts[k] = cut
    return len(concave)


def _flattened(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(n, 2) coordinates in the plane of a normal, counter-clockwise about it."""
    right = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    up = np.cross(normal, right)
    axes = np.stack([right / np.linalg.norm(right), up / np.linalg.norm(up)])
    return np.ascontiguousarray(np.einsum("ni,ki->nk", points, axes))


def _earcut(points: np.ndarray) -> np.ndarray | None:
    """(n - 2, 3) triangles of a counter-clockwise polygon; None where it crosses itself and so cannot be cut."""
    count = len(points)
    flat = mapbox_earcut.triangulate_float64(points, np.array([count], np.uint32)).astype(np.int64).reshape(-1, 3)
    a, b, c = (points[flat[:, k]] for k in range(3))
    e, f = b - a, c - a
    is_turned = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0] < 0.0
    flat[is_turned] = flat[is_turned][:, ::-1]
    # Corners on a straight line are left out: put each back into the triangle along that line.
    triangles = [(int(a), int(b), int(c)) for a, b, c in flat]
    beside = {edge: k for k, triangle in enumerate(triangles) for edge in _edges(triangle)}
    used = sorted({corner for triangle in triangles for corner in triangle})
    for before, after in zip(used, [*used[1:], *used[:1]], strict=True):
        last = before
        for number in range(before + 1, after if after > before else after + count):
            corner, place = number % count, beside.get((last, after))
            if place is None:
                return None
            other = next(third for third in triangles[place] if third not in (last, after))
            triangles[place] = (corner, after, other)
            triangles.append((last, corner, other))
            beside |= dict.fromkeys(_edges(triangles[place]), place)
            beside |= dict.fromkeys(_edges(triangles[-1]), len(triangles) - 1)
            last = corner
    return np.array(triangles) if len(triangles) == count - 2 else None


def _edges(triangle: tuple[int, int, int]) -> list[tuple[int, int]]:
    a, b, c = triangle
    return [(a, b), (b, c), (c, a)]
