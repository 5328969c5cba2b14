"""The sides of sheets that were modelled twice, back to back.

A triangle belongs to such a sheet if its mirror image, the same three places the other way round, is in the mesh too.
The mean of both facets' normals would be zero. So at its corners the faces are put into groups, the *sides*, each with
a normal of its own. Two faces that share an edge are in one group if they look at each other round it: turning from the
front of one about the edge, the other is the first face met, and it is met from its front.

A *place* is a point where vertices stand, a *corner* one of a triangle's three: corner 3 * triangle + 0, 1 or 2.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.base import budget

SMALLEST_SINE = wp.constant(wp.float64(1e-14))
"""Sine of the angle between two edges of a triangle: below it, rounding in float64 decides where their plane is."""

BYTES_PER_CANDIDATE = 300
"""Memory for each triangle that may have a mirror image, as measured."""

SCATTER = np.uint64(0x9E3779B97F4A7C15)
"""An odd number whose multiples are spread over all numbers of 64 bits."""

BLOCK = 1 << 17
"""Corners whose sides are found at a time: memory stays small."""

SAME_TURN = 1e-9
"""Radians round an edge within which two triangles count as lying on each other. Those with the same corners differ by
nothing: equal corners give equal bits."""


def sides_by_places(
    vertices: np.ndarray, places: np.ndarray, is_suspect: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The sides at the corners of all places where triangles have mirror images.

    Args:
        vertices: (n, 3) float64.
        places: (m, 3) int32, the triangles' corners as places.
        is_suspect: (n,) bool, places where such triangles may be.

    Returns:
        (k,) corner numbers, (k,) their sides, (sides, 3) float32 unit normals.
    """
    has_image = _has_mirror_image(places, is_suspect)
    is_folded = np.zeros(len(vertices), bool)
    is_folded[places[has_image]] = True
    corners = np.flatnonzero(is_folded[places.reshape(-1)])
    here = places.reshape(-1)[corners]
    # Go through the corners by place, whole places at a time.
    order = np.argsort(here, kind="stable")
    here = here[order]
    sides = np.empty(len(corners), np.int64)
    side_normals = []
    begin = count = 0
    while begin < len(order):
        last = here[min(begin + BLOCK, len(order)) - 1]
        end = int(np.searchsorted(here, last, side="right"))
        block = order[begin:end]
        of_block, normals = _sides_of(vertices, places, corners[block], has_image)
        sides[block] = count + of_block
        side_normals.append(normals)
        begin, count = end, count + len(normals)
    return corners, sides, np.concatenate(side_normals) if side_normals else np.zeros((0, 3), np.float32)


def _sides_of(
    vertices: np.ndarray, places: np.ndarray, corners: np.ndarray, has_image: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The sides of all corners at some places: (k,) their numbers, and (sides, 3) float32 unit normals."""
    triangle, k = np.divmod(corners, 3)
    here, ahead, behind = (places[triangle, (k + turn) % 3].astype(np.int64) for turn in range(3))
    side = _connected(vertices, here, ahead, behind)
    # Groups in which no triangle has a mirror image are not of a sheet: at each place they make one side together.
    is_of_sheet = np.zeros(len(corners), bool)
    is_of_sheet[side[has_image[triangle]]] = True
    side = np.where(is_of_sheet[side], side, len(corners) + here)
    _, side = np.unique(side, return_inverse=True)
    weighted = _weighted_normals(vertices[here], vertices[ahead], vertices[behind])
    total = np.stack([np.bincount(side, weights=weighted[:, axis]) for axis in range(3)], 1)
    return side, _unit(total).astype(np.float32)


def triangles_with_image(places: np.ndarray) -> np.ndarray:
    """(m,) bool: triangles whose three places another triangle has the other way round.

    Args:
        places: (m, 3) int32, the triangles' corners as places.

    Raises:
        InputError: it needs more memory than is allowed.
    """
    # Only triangles with the same three places, in any order, can be images: a sum tells most others apart.
    with np.errstate(over="ignore"):
        sums = (places.astype(np.uint64) * SCATTER ^ (places.astype(np.uint64) >> np.uint64(3))).sum(axis=1)
    _, group, count = np.unique(sums, return_inverse=True, return_counts=True)
    is_suspect = np.zeros(int(places.max()) + 1, bool)
    is_suspect[places[count[group] > 1]] = True
    return _has_mirror_image(places, is_suspect)


def _has_mirror_image(places: np.ndarray, is_suspect: np.ndarray) -> np.ndarray:
    """(m,) bool: triangles whose three places another triangle has the other way round."""
    result = np.zeros(len(places), bool)
    candidates = np.flatnonzero(is_suspect[places].all(axis=1))
    budget.take(BYTES_PER_CANDIDATE * len(candidates), "the sides of triangles that were modelled twice")
    corners = places[candidates]
    distinct = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    candidates, corners = candidates[distinct], corners[distinct]
    rising = np.sort(corners, axis=1)
    # A triangle that starts with its lowest place goes on with the middle one or with the highest.
    after_lowest = np.take_along_axis(corners, (np.argmin(corners, axis=1)[:, None] + 1) % 3, axis=1)[:, 0]
    turns = (after_lowest != rising[:, 1]).astype(np.int64)
    order = np.lexsort((rising[:, 2], rising[:, 1], rising[:, 0]))
    changes = (np.diff(rising[order], axis=0, prepend=-1) != 0).any(axis=1)
    group = np.empty(len(candidates), np.int64)
    group[order] = np.cumsum(changes) - 1
    turned, all_of_them = np.bincount(group, weights=turns), np.bincount(group)
    result[candidates] = ((turned > 0) & (turned < all_of_them))[group] if len(group) else False
    return result


def _connected(vertices: np.ndarray, here: np.ndarray, ahead: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """(k,) int64: the side of each corner, a number below k. Faces that look at each other round an edge are connected.

    Args:
        vertices: (n, 3) float64.
        here: (k,) the corners' places.
        ahead: (k,) the next corner's place in each one's triangle.
        behind: (k,) the one's after that.
    """
    from scipy.sparse import coo_array  # noqa: PLC0415  a fifth of a second, and few meshes need it
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    count = len(here)
    # Each corner has two edges: its triangle leaves by the first and comes back by the second.
    corner = np.tile(np.arange(count), 2)
    leaves = np.repeat([True, False], count)
    start, end = np.tile(here, 2), np.concatenate([ahead, behind])
    third = np.concatenate([behind, ahead])
    is_edge = (start != end) & (start != third) & (end != third)
    corner, leaves, start, end, third = (x[is_edge] for x in (corner, leaves, start, end, third))
    _, edge = np.unique(start * len(vertices) + end, return_inverse=True)

    # Order the triangles round each edge by angle; those that lie on each other are one level.
    turn = _turns(vertices, edge, start, end, third)
    order = np.lexsort((turn, edge))
    corner, leaves, edge, turn = corner[order], leaves[order], edge[order], turn[order]
    is_new_edge = np.diff(edge, prepend=-1) != 0
    level = np.cumsum(is_new_edge | (np.diff(turn, prepend=0.0) > SAME_TURN)) - 1
    lowest = level[is_new_edge][edge]
    highest = np.concatenate([level[is_new_edge][1:] - 1, level[-1:]])[edge]

    # A front looks at the space between its level and the one after, or before. Connect faces that look at one space.
    space = np.where(leaves, level, np.where(level > lowest, level - 1, highest))
    sees = highest > lowest
    graph = coo_array(
        (np.ones(sees.sum(), np.int8), (corner[sees], count + space[sees])), shape=(2 * count + len(level),) * 2
    )
    _, component = connected_components(graph, directed=False)
    _, side = np.unique(component[:count], return_inverse=True)
    return side


def _turns(vertices: np.ndarray, edge: np.ndarray, start: np.ndarray, end: np.ndarray, third: np.ndarray) -> np.ndarray:
    """(k,) angles round each edge, 0 to 2 pi, of the triangles that have it.

    They are measured from the triangle whose third place is farthest from the edge. They rise the way that the front of
    a triangle looks which goes along the edge from ``start`` to ``end``.
    """
    along = _unit(vertices[end] - vertices[start])
    out = _unit(vertices[third] - vertices[start])
    out = out - (out * along).sum(axis=1, keepdims=True) * along
    order = np.lexsort((third, -(out**2).sum(axis=1), edge))
    widest = order[np.diff(edge[order], prepend=-1) != 0][edge]
    across = np.cross(along, out[widest])
    turn = np.arctan2((out * across).sum(axis=1), (out * out[widest]).sum(axis=1)) % (2 * np.pi)
    return np.where(turn > 2 * np.pi - SAME_TURN, 0.0, turn)


def _weighted_normals(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """(k, 3): what ``weighted_normal`` of ``normals.py`` gives, for arrays."""
    e, f = b - a, c - a
    across = np.cross(e, f)
    area = np.linalg.norm(across, axis=1)
    lengths = np.linalg.norm(e, axis=1) * np.linalg.norm(f, axis=1)
    angle = np.arctan2(area, (e * f).sum(axis=1))
    has_area = area > float(SMALLEST_SINE) * lengths
    return across * np.where(has_area, angle / np.where(has_area, area, 1.0), 0.0)[:, None]


def _unit(vectors: np.ndarray) -> np.ndarray:
    """(k, 3) unit vectors; zero stays zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
