"""The point O from which all of a star-shaped surface is seen (Roger and Holzschuch 2006, section 3.3.1).

It lies on one side of the planes of all triangles. Such points are the polyhedron's kernel, an intersection of half
spaces, so that one deep inside it is found by linear programming.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

CLEAR_COSINE = 0.2
"""Of a direction from O with the normal where it meets the surface: a point that sees all triangles by at least this is
taken without a search for a better one."""

LEAST_COSINE = 0.01
"""Triangles that are seen more edge-on than this have a radius that changes a hundredfold within their width."""

FARTHEST = 1.5
"""How far from the middle of its box a point that sees an open surface may be along an axis, in sides of the box."""

NEARNESS = 0.01
"""What a step away from the middle of the box costs, in steps away from the planes: of the many points that see an open
surface equally well, one near it is taken."""


def star_centre(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray | None:
    """The point that sees all triangles from one side, least edge-on; None if no point does.

    Whether one triangle of an open surface hides another is not asked. Tried are the centre of the box, the mean of the
    surface, and the point of the kernel that is farthest from all planes.

    Args:
        vertices: (n, 3) float64.
        faces: (m, 3) vertex numbers.
    """
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled_areas = np.linalg.norm(across, axis=1)
    is_flat = doubled_areas <= 0.0
    if is_flat.all():
        return None
    corners, normals = corners[~is_flat], across[~is_flat] / doubled_areas[~is_flat, None]
    means = corners.mean(axis=1)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    best, best_cosine = None, LEAST_COSINE
    for point in ((low + high) / 2.0, np.average(means, axis=0, weights=doubled_areas[~is_flat])):
        cosine = _least_cosine(point, corners, normals)
        if cosine > best_cosine:
            best, best_cosine = point, cosine
    if best_cosine >= CLEAR_COSINE:
        return best
    for outwards in (normals, -normals):
        point = _kernel_point(corners[:, 0], outwards, low, high)
        if point is not None and _least_cosine(point, corners, normals) > best_cosine:
            best, best_cosine = point, _least_cosine(point, corners, normals)
    return best


def _least_cosine(point: np.ndarray, corners: np.ndarray, normals: np.ndarray) -> float:
    """How edge-on the triangles are seen from a point, at worst; negative if it does not see the same side of all."""
    ways = corners - point
    heights = np.einsum("ij,ij->i", ways[:, 0], normals)
    cosines = heights / np.maximum(np.linalg.norm(ways, axis=2).max(axis=1), np.finfo(float).tiny)
    return float(max(cosines.min(), -cosines.max()))


def _kernel_point(points: np.ndarray, outwards: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray | None:
    """The point farthest inside all planes, by up to the longest side of their box; None if there is none."""
    size = float((high - low).max())
    middle = (low + high) / 2.0
    # In units of the size about the middle, O = p - q with p and q not negative: maximise t, less a little of p + q,
    # where outwards . (p - q) + t <= outwards . point.
    rows = np.concatenate([outwards, -outwards, np.ones((len(outwards), 1))], axis=1)
    limits = np.einsum("ij,ij->i", outwards, points - middle) / size
    bounds = [(0.0, FARTHEST)] * 6 + [(0.0, 1.0)]
    found = linprog([NEARNESS] * 6 + [-1.0], A_ub=rows, b_ub=limits, bounds=bounds, method="highs")
    return middle + size * (found.x[:3] - found.x[3:6]) if found.status == 0 else None
