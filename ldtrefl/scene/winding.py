"""Triangles that are wound the other way than their neighbours, as normals are averaged.

Two triangles that share an edge are wound alike if they run along it in opposite directions. In a mesh that is wound
both ways the facets' normals about a place would cancel, and a smooth mirror show noise. So in each part of the surface
that can be wound alike, the triangles of the smaller number count as turned. A part without two sides, such as a
Moebius strip, stays as it is; so do parts that meet only at edges of three triangles or more.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.base import budget

BYTES_PER_TRIANGLE = 300
"""Memory while the winding of triangles is looked at: 213 bytes were measured, and SciPy takes some besides."""


def turned_triangles(places: np.ndarray) -> np.ndarray:
    """(m,) bool: triangles that are wound the other way than most of their part of the surface.

    Args:
        places: (m, 3) int32, the triangles' corners as places: vertices of one place are one.

    Raises:
        InputError: it needs more memory than is allowed.
    """
    from scipy.sparse import coo_array  # noqa: PLC0415  a fifth of a second, and few meshes need it
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    count = len(places)
    budget.take(BYTES_PER_TRIANGLE * count, "the winding of triangles")
    one, other, is_alike = _pairs(places)
    # A triangle as it is and the same turned are two nodes: if they are connected, there are no two sides.
    as_it_is = np.concatenate([one, one + count])
    beside = np.concatenate([np.where(is_alike, other, other + count), np.where(is_alike, other + count, other)])
    graph = coo_array((np.ones(len(as_it_is), np.int8), (as_it_is, beside)), shape=(2 * count,) * 2)
    _, sheet = connected_components(graph, directed=False)
    as_it_is, turned = sheet[:count], sheet[count:]
    sizes = np.bincount(as_it_is, minlength=sheet.max() + 1)
    # Of the two ways to wind a part take the one that more triangles have; of equals the one of its first triangle.
    is_turned = (sizes[turned] > sizes[as_it_is]) | ((sizes[turned] == sizes[as_it_is]) & (turned < as_it_is))
    return is_turned & (as_it_is != turned)


def _pairs(places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(k,) triangles, (k,) those beside them, (k,) bool whether both are wound alike, at the edges of two triangles."""
    begin, end = places.reshape(-1).astype(np.int64), places[:, [1, 2, 0]].reshape(-1).astype(np.int64)
    edge = np.minimum(begin, end) << 32 | np.maximum(begin, end)
    order = np.argsort(edge, kind="stable")
    edge = edge[order]
    is_first = np.diff(edge, prepend=-1) != 0
    of_edge = np.diff(np.append(np.flatnonzero(is_first), len(edge)))
    first = np.flatnonzero(is_first)[of_edge == 2]
    half, other_half = order[first], order[first + 1]
    third = places[:, [2, 0, 1]].reshape(-1)
    # A triangle that was modelled twice lies on itself, and not beside.
    is_edge = (begin[half] != end[half]) & (third[half] != third[other_half])
    half, other_half = half[is_edge], other_half[is_edge]
    return half // 3, other_half // 3, begin[half] != begin[other_half]
