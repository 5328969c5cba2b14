"""Whether a ray that leaves a mesh's surface can come back to it.

It cannot from a flat mesh, nor from the outside of a convex one. A mirror of such a mesh need not be searched for its
own rays: nothing is made for that.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.welding import first_of_equals

FRONT, BACK = 1, 2
"""Bits of the sides of the triangles, by their winding, from which rays can come back."""

RISE = 1e-6
"""How far a surface may rise over the plane of one of its triangles and still count as flat or convex there: a share of
half the longest side of the box about it, as far as rays start above their own triangle (``world/unit_rays.py``)."""

SAMPLES = 16
"""Triangles over whose planes all vertices are tested first: most meshes that are not convex show it here."""

MOST_SAMPLED = 1 << 12
"""Triangles, about, that are looked at before all are."""

WHOLE = 1e-3
"""How far the solid angle of a closed surface may be off the whole sphere's, as a share."""


def sides_with_returns(vertices: np.ndarray, faces: np.ndarray) -> int:
    """From which sides of its triangles rays can come back to a mesh: ``FRONT`` and ``BACK``, or 0 if from none.

    Args:
        vertices: (n, 3) float64, whose box has a longest side of about 2.
        faces: (m, 3) int32.
    """
    if _returns_surely(vertices, faces):
        return FRONT | BACK
    normals, has_area = _normals(vertices, faces)
    # A triangle without area meets no ray and sends none.
    faces, normals = faces[has_area], normals[has_area]
    if len(faces) == 0:
        return 0
    sides = _sides_with_rises(vertices[np.unique(faces)], vertices, faces, normals)
    if sides == 0:
        return FRONT | BACK
    if sides == FRONT | BACK:
        return 0  # all vertices lie in one plane
    outwards = normals if sides == FRONT else -normals
    if not _is_convex(vertices, faces if sides == FRONT else faces[:, ::-1], outwards):
        return FRONT | BACK
    return BACK if sides == FRONT else FRONT


def _normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3) unit normals of triangles, and (m,) whether they have an area; those that have none have no normal."""
    normals = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    lengths = np.linalg.norm(normals, axis=1)
    has_area = lengths > 0.0
    return normals / np.where(has_area, lengths, 1.0)[:, None], has_area


def _sides_with_rises(used: np.ndarray, vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> int:
    """Of a sample of triangles: ``FRONT`` if no used vertex rises over the front of any, ``BACK`` if none does over the
    back, both if all lie in the planes of all."""
    sides = FRONT | BACK
    for k in np.linspace(0, len(faces) - 1, SAMPLES).astype(int):
        heights = (used - vertices[faces[k, 0]]) @ normals[k]
        sides &= (FRONT if heights.max() <= RISE else 0) | (BACK if heights.min() >= -RISE else 0)
        if sides == 0:
            break
    return sides


def _returns_surely(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Whether some triangles alone show that rays can come back to a mesh; large meshes need not be looked at whole."""
    some = faces[:: max(1, len(faces) // MOST_SAMPLED)]
    normals, has_area = _normals(vertices, some)
    some, normals = some[has_area], normals[has_area]
    return len(some) > 0 and _sides_with_rises(vertices[some[:, 0]], vertices, some, normals) == 0


def _is_convex(vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> bool:
    """Whether a surface is closed and convex, wound so that its normals point outwards.

    It is if it bends outwards at every edge, and is seen from one point within as a sphere would be: once in every
    direction, from the back.
    """
    firsts = first_of_equals(vertices)
    places = faces.astype(np.int64) if firsts is None else firsts[faces].astype(np.int64)
    begin, end = places.reshape(-1), places[:, [1, 2, 0]].reshape(-1)
    opposite, triangle = places[:, [2, 0, 1]].reshape(-1), np.repeat(np.arange(len(faces)), 3)
    count = len(vertices)
    ahead, order = np.unique(begin * count + end, return_index=True)
    if len(ahead) < len(begin):
        return False  # two triangles run the same way along an edge
    twin = np.searchsorted(ahead, end * count + begin)
    twin[twin == len(ahead)] = 0
    if not np.array_equal(ahead[twin], end * count + begin):
        return False  # an edge has one triangle alone
    beyond = vertices[opposite[order[twin]]] - vertices[begin]
    if ((beyond * normals[triangle]).sum(axis=1) > RISE).any():
        return False
    within = vertices[np.unique(faces)].mean(axis=0)
    return _is_seen_once(vertices[faces] - within, normals)


def _is_seen_once(corners: np.ndarray, normals: np.ndarray) -> bool:
    """Whether the triangles of (m, 3, 3) ``corners`` are all seen from the back from 0, and fill the whole sphere there
    once; the solid angles are by van Oosterom and Strackee (1983)."""
    if not ((corners[:, 0] * normals).sum(axis=1) > 0.0).all():
        return False
    a, b, c = corners.transpose(1, 0, 2)
    la, lb, lc = np.linalg.norm(corners, axis=2).T
    volume = (a * np.cross(b, c)).sum(axis=1)
    across = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    solid_angle = 2.0 * np.arctan2(volume, across).sum()
    return bool(abs(solid_angle / (4.0 * np.pi) - 1.0) <= WHOLE)
