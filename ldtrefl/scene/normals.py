"""Vertex normals from the faces: vertices of one place are welded, and faces are averaged by side.

A normal is the mean of the facets' unit normals about a place, each weighted by its angle there. All is done in
float64, and every place adds up its triangles in the order of their numbers: the bits do not depend on the threads.

*Welding* is by equality of coordinates, bit by bit (but -0 is 0): two vertices are one if the mesh says so, however
close others may lie.

*Sides*: a triangle whose mirror image, the same three places the other way round, is in the mesh too belongs to a sheet
that was modelled twice. The mean of both would be nothing. So about its corners faces are put into groups that share
edges front to front: round an edge, a face goes with the one that its front meets first, if that one's front is what it
meets. Where no triangle has a mirror image, all faces of a place make one group, as ever.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.bins import bin_items
from ldtrefl.scene.welding import first_of_equals

SMALLEST_SINE = wp.constant(wp.float64(1e-14))
"""Of the angle between two edges: below it, float64 gives their plane by chance."""

FEW_CORNERS = wp.constant(24)
"""Corners at a place up to which every pair is compared, to find triangles that mirror each other. Meshes have six."""

FOLDED = wp.constant(1)
"""At this place a triangle and its mirror image meet."""

CROWDED = wp.constant(2)
"""At this place more corners meet than are compared."""

SMALLEST_EXPONENT = -1000
"""Of the largest coordinate: what is smaller is not scaled up to 1, which would overflow."""

MOST_CORNERS = (1 << 31) - 1
"""Corners are numbered in int32."""

BYTES_PER_CANDIDATE = 300
"""Memory for each triangle that may have a mirror image, as measured."""

BLOCK = 1 << 17
"""Corners whose sides are found at a time."""

SAME_TURN = 1e-9
"""Radians round an edge within which two triangles lie on each other; equal corners give equal bits."""


@launch.kernel
def list_sides(
    first: int,
    # In:
    places: wp.array(dtype=wp.int32),  # of all corners
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    # Out:
    sides_out: wp.array(dtype=wp.vec2i),  # the two other places of the triangle, in its order
):
    corner = first + wp.tid()
    triangle = 3 * (corner // 3)
    k = corner - triangle
    ahead, behind = k + 1, k + 2
    if ahead > 2:
        ahead = 0
    if behind > 2:
        behind = behind - 3
    sides_out[start[places[corner]] + ranks[corner]] = wp.vec2i(places[triangle + ahead], places[triangle + behind])


@wp.func
def weighted_normal(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, scale: wp.float64):
    """Unit normal of the triangle times its angle at ``a``; zero without an area."""
    e, f = scale * (b - a), scale * (c - a)
    across = wp.cross(e, f)
    area, lengths = wp.length(across), wp.length(e) * wp.length(f)
    if not area > SMALLEST_SINE * lengths:
        return wp.vec3d()
    return across * (wp.atan2(area, wp.dot(e, f)) / area)


@launch.kernel
def average_about_places(
    first: int,
    # In:
    vertices: wp.array(dtype=wp.vec3d),
    scale: wp.float64,
    start: wp.array(dtype=wp.int32),
    sides: wp.array(dtype=wp.vec2i),
    # Out:
    normals_out: wp.array(dtype=wp.vec3),
    folds_out: wp.array(dtype=wp.uint8),
):
    i = first + wp.tid()
    begin, end = start[i], start[i + 1]
    total = wp.vec3d()
    fold = int(0)
    if end - begin > FEW_CORNERS:
        fold = CROWDED
    for k in range(begin, end):
        side = sides[k]
        total += weighted_normal(vertices[i], vertices[side[0]], vertices[side[1]], scale)
        if fold == 0:
            for other in range(begin, k):
                if sides[other][0] == side[1] and sides[other][1] == side[0]:
                    fold = FOLDED
    folds_out[i] = wp.uint8(fold)
    length = wp.length(total)
    if length > wp.float64(0.0):
        total = total / length
    normals_out[i] = wp.vec3(float(total[0]), float(total[1]), float(total[2]))


@dataclass(frozen=True, eq=False)
class _Smoothed:
    """Normals of the vertices, and of the corners at places where triangles mirror each other."""

    normals: np.ndarray
    """(n, 3) float32; not those of ``corners``' vertices."""
    corners: np.ndarray
    """(k,) int64, corner numbers, rising: 3 * triangle + 0, 1, 2."""
    sides: np.ndarray
    """(k,) int64, the side that each belongs to: a row of ``side_normals``."""
    side_normals: np.ndarray
    """(sides, 3) float32."""


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(n, 3) float32 unit normals of (n, 3) float64 vertices with (m, 3) int32 faces.

    Zero where undefined: where no triangle with an area meets, and where one vertex serves several sides.

    Raises:
        InputError: too many triangles.
    """
    found = _smoothed(vertices, faces, None)
    used = faces.reshape(-1)[found.corners]
    pairs = np.unique(np.stack([used, found.sides], 1), axis=0)
    serves = np.bincount(pairs[:, 0], minlength=1)
    found.normals[pairs[:, 0]] = np.where(serves[pairs[:, :1]] == 1, found.side_normals[pairs[:, 1]], np.float32(0.0))
    return found.normals


def split_by_side(
    vertices: np.ndarray, faces: np.ndarray, pieces: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normals of a mesh whose vertices are doubled where one would serve several sides.

    Args:
        vertices: (n, 3) float64.
        faces: (m, 3) int32.
        pieces: (n,) numbers; vertices of different pieces are not welded.

    Returns:
        sources: (n + k,) int64, which vertex each of the new ones is: 0 to n - 1 and then the doubled ones.
        faces: (m, 3) int32, the same triangles in the same order.
        normals: (n + k, 3) float32.

    Raises:
        InputError: too many triangles, or more memory for their sides than is allowed.
    """
    found = _smoothed(vertices, faces, pieces)
    sources = np.arange(len(vertices))
    if len(found.corners) == 0:
        return sources, faces, found.normals
    # One vertex for each (vertex, side), the first side of each keeps the vertex itself.
    pairs = np.stack([faces.reshape(-1)[found.corners], found.sides], 1)
    distinct, inverse = np.unique(pairs, axis=0, return_inverse=True)
    is_first = np.concatenate([[True], distinct[1:, 0] != distinct[:-1, 0]])
    numbers = np.where(is_first, distinct[:, 0], len(vertices) + np.cumsum(~is_first) - 1)
    split = faces.copy()
    split.reshape(-1)[found.corners] = numbers[inverse.reshape(-1)]
    sources = np.concatenate([sources, distinct[~is_first, 0]])
    normals = np.concatenate([found.normals, np.zeros((len(sources) - len(vertices), 3), np.float32)])
    normals[numbers] = found.side_normals[distinct[:, 1]]
    return sources, split, normals


def _smoothed(vertices: np.ndarray, faces: np.ndarray, pieces: np.ndarray | None) -> _Smoothed:
    corner_count = max(3 * len(faces), 2 * len(vertices))
    if corner_count > MOST_CORNERS:
        raise InputError(
            f"{len(faces)} triangles are too many for smooth normals, at most {MOST_CORNERS // 3} are allowed"
        )
    device = launch.resolve_device("cpu")
    largest = max(float(vertices.max()), -float(vertices.min()))
    # By a power of two, so that nothing is rounded.
    scale = float(np.ldexp(1.0, -max(int(np.frexp(largest)[1]), SMALLEST_EXPONENT)))
    firsts = first_of_equals(vertices if pieces is None else np.column_stack([vertices, pieces]))
    places = np.ascontiguousarray(faces if firsts is None else firsts[faces]).reshape(-1)
    shared = wp.array(places, dtype=wp.int32, device=device, copy=False)
    start, ranks = bin_items(shared, len(vertices), device)
    sides = wp.empty(len(places), dtype=wp.vec2i, device=device)
    launch.launch(list_sides, len(places), [shared, start, ranks, sides], device)
    normals = wp.empty(len(vertices), dtype=wp.vec3, device=device)
    folds = wp.empty(len(vertices), dtype=wp.uint8, device=device)
    points = wp.array(vertices, dtype=wp.vec3d, device=device, copy=False)
    arguments = [points, wp.float64(scale), start, sides, normals, folds]
    launch.launch(average_about_places, len(vertices), arguments, device)
    of_places = normals.numpy()
    of_vertices = of_places if firsts is None else of_places[firsts]
    none = np.zeros(0, np.int64)
    if not folds.numpy().any():
        return _Smoothed(of_vertices, none, none, np.zeros((0, 3), np.float32))
    corners, numbers, side_normals = _by_side(vertices * scale, places.reshape(-1, 3), folds.numpy() > 0)
    return _Smoothed(of_vertices, corners, numbers, side_normals)


def _by_side(
    vertices: np.ndarray, places: np.ndarray, is_suspect: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The sides at the places where triangles have mirror images.

    Args:
        vertices: (n, 3) float64.
        places: (m, 3) int32, the triangles' corners as places.
        is_suspect: (n,) bool, the places that such triangles can have.

    Returns:
        (k,) corner numbers, (k,) their sides, (sides, 3) float32 unit normals.
    """
    has_image = _has_mirror_image(places, is_suspect)
    is_folded = np.zeros(len(vertices), bool)
    is_folded[places[has_image]] = True
    corners = np.flatnonzero(is_folded[places.reshape(-1)])
    here = places.reshape(-1)[corners]
    # A place after another, some at a time, so that little memory is needed.
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
    # As ever, all that has no mirror image makes one side.
    with_image = np.zeros(len(corners), bool)
    with_image[side[has_image[triangle]]] = True
    side = np.where(with_image[side], side, len(corners) + here)
    _, side = np.unique(side, return_inverse=True)
    weighted = _weighted_normals(vertices[here], vertices[ahead], vertices[behind])
    total = np.stack([np.bincount(side, weights=weighted[:, axis]) for axis in range(3)], 1)
    return side, _unit(total).astype(np.float32)


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
    """(k,) int64: numbers below k of the sides of corners at ``here``, faces joined round the edges front to front."""
    count = len(here)
    # Each corner has two edges: the first it leaves by, the second it comes back by.
    corner = np.tile(np.arange(count), 2)
    leaves = np.repeat([True, False], count)
    start, end = np.tile(here, 2), np.concatenate([ahead, behind])
    third = np.concatenate([behind, ahead])
    is_edge = (start != end) & (start != third) & (end != third)
    corner, leaves, start, end, third = (x[is_edge] for x in (corner, leaves, start, end, third))
    _, edge = np.unique(start * len(vertices) + end, return_inverse=True)

    # Round an edge: the half-planes of its triangles by angle, those that lie on each other as one level.
    turn = _turns(vertices, edge, start, end, third)
    order = np.lexsort((turn, edge))
    corner, leaves, edge, turn = corner[order], leaves[order], edge[order], turn[order]
    is_new_edge = np.diff(edge, prepend=-1) != 0
    level = np.cumsum(is_new_edge | (np.diff(turn, prepend=0.0) > SAME_TURN)) - 1
    lowest = level[is_new_edge][edge]
    highest = np.concatenate([level[is_new_edge][1:] - 1, level[-1:]])[edge]

    # A front that looks on looks at the space between its level and the next, one that looks back at the one before.
    space = np.where(leaves, level, np.where(level > lowest, level - 1, highest))
    sees = highest > lowest
    graph = coo_array(
        (np.ones(sees.sum(), np.int8), (corner[sees], count + space[sees])), shape=(2 * count + len(level),) * 2
    )
    _, component = connected_components(graph, directed=False)
    _, side = np.unique(component[:count], return_inverse=True)
    return side


def _turns(vertices: np.ndarray, edge: np.ndarray, start: np.ndarray, end: np.ndarray, third: np.ndarray) -> np.ndarray:
    """Angles round each edge from the one of its triangles that is widest there, 0 to 2 pi, rising the way that the
    front of a triangle looks which has the edge from ``start`` to ``end``."""
    along = _unit(vertices[end] - vertices[start])
    out = _unit(vertices[third] - vertices[start])
    out = out - (out * along).sum(axis=1, keepdims=True) * along
    order = np.lexsort((third, -(out**2).sum(axis=1), edge))
    widest = order[np.diff(edge[order], prepend=-1) != 0][edge]
    across = np.cross(along, out[widest])
    turn = np.arctan2((out * across).sum(axis=1), (out * out[widest]).sum(axis=1)) % (2 * np.pi)
    return np.where(turn > 2 * np.pi - SAME_TURN, 0.0, turn)


def _weighted_normals(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """What :func:`weighted_normal` gives, for arrays."""
    e, f = b - a, c - a
    across = np.cross(e, f)
    area = np.linalg.norm(across, axis=1)
    lengths = np.linalg.norm(e, axis=1) * np.linalg.norm(f, axis=1)
    angle = np.arctan2(area, (e * f).sum(axis=1))
    has_area = area > float(SMALLEST_SINE) * lengths
    return across * np.where(has_area, angle / np.where(has_area, area, 1.0), 0.0)[:, None]


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
