"""Whether a mesh is made of solids: closed surfaces, each wound so that its fronts are outside.

From outside only fronts of solids are seen. So it is all the same whether the backs of their triangles are hidden. A
surface that passes through itself so that a part of it is inside out counts as a solid by the rest of it.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.scene.closed_check import is_closed
from ldtrefl.scene.welding import first_of_equals

BYTES_PER_TRIANGLE = 250
"""Memory while volumes are found."""

FLATTEST = 1e-9
"""Volume below this times the area's power of 1.5 is rounding: a sheet that is modelled twice, once for each side."""


def is_solid(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Whether a mesh is closed, and each of its connected surfaces encloses a volume above 0 by its winding.

    Args:
        vertices: (n, 3) float64; those of one place count as one.
        faces: (m, 3) int32.

    Raises:
        InputError: it needs more memory than is allowed.
    """
    budget.take(BYTES_PER_TRIANGLE * len(faces), "which sides of triangles are outside")
    on_device = wp.array(faces, dtype=wp.vec3i, device=launch.resolve_device("cpu"), copy=False)
    if not is_closed(vertices, on_device):
        return False
    firsts = first_of_equals(vertices)
    surface = _surfaces(faces if firsts is None else firsts[faces], len(vertices))
    a, b, c = (np.ascontiguousarray(vertices[faces[:, k]].T) for k in range(3))
    across = _cross(b - a, c - a)
    # From a corner of its own surface, so that a small one far away loses nothing.
    corner = np.zeros((surface.max() + 1, 3))
    corner[surface] = a.T
    a -= corner[surface].T
    volume = np.bincount(surface, weights=(a * across).sum(axis=0)) / 6.0
    area = np.bincount(surface, weights=np.sqrt((across * across).sum(axis=0))) / 2.0
    return bool(((volume > FLATTEST * area**1.5) | (area == 0.0)).all())


def _cross(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(3, m) cross products; numpy's takes twice as long."""
    return np.stack([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])


def _surfaces(places: np.ndarray, count: int) -> np.ndarray:
    """(m,) the number of each triangle's surface: those that share a place are one; ``places`` are below ``count``."""
    from scipy.sparse import coo_array  # noqa: PLC0415  a fifth of a second, and few meshes need it
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    one, other = np.concatenate([places[:, 0], places[:, 1]]), np.concatenate([places[:, 1], places[:, 2]])
    graph = coo_array((np.ones(len(one), np.int8), (one, other)), shape=(count, count))
    _, number = connected_components(graph, directed=False)
    return np.asarray(number[places[:, 0]])
