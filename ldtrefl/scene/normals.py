"""Vertex normals from the faces: vertices of one place are welded, and faces are averaged.

A normal is the mean of the facets' unit normals about a place, each weighted by its angle there. All is done in
float64, and every place adds up its triangles in the order of their numbers: the bits do not depend on the threads.

*Welding* is by equality of coordinates, bit by bit (but -0 is 0): two vertices are one if the mesh says so, however
close others may lie (``welding.py``).

*Sides*: at places where triangles and their mirror images meet, the faces of each side are averaged by themselves
(``two_sided.py``). Elsewhere all faces of a place are averaged together. Triangles that are wound the other way than
those about them are turned for that (``winding.py``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.bins import bin_items
from ldtrefl.scene.two_sided import SMALLEST_SINE, sides_by_places
from ldtrefl.scene.welding import first_of_equals
from ldtrefl.scene.winding import turned_triangles

FEW_CORNERS = wp.constant(24)
"""Corners at a place up to which every pair is compared, to find triangles that mirror each other. Most have six."""

FOLDED = wp.constant(1)
"""Flag of a place: a triangle and its mirror image meet there."""

CROWDED = wp.constant(2)
"""Flag of a place: more corners meet there than are compared."""

UNLIKE = wp.constant(4)
"""Flag of a place: two triangles run the same way along an edge there."""

CANCELLED = wp.constant(wp.float64(1e-5))
"""Length of a place's mean, over that of as many normals that are equal, up to which they cancel. What is left is
rounding, and points anywhere. There are such places where a sheet was modelled twice, with other diagonals on its back:
with coordinates of float32 7e-6 were found, at a thousand triangles along a side. Scans have places of 3e-5, which are
sharp edges."""

SMALLEST_EXPONENT = -1000
"""Exponent of the largest coordinate: meshes that are smaller are not scaled up to 1, since the factor would
overflow."""

MOST_CORNERS = (1 << 31) - 1
"""Corners are numbered in int32."""


@launch.kernel
def list_corners(
    first: int,
    # In:
    places: wp.array(dtype=wp.int32),  # of all corners
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    # Out:
    opposite_out: wp.array(dtype=wp.vec2i),  # the two other places of the triangle, in its order
):
    """Write one corner into the list of its place."""
    corner = first + wp.tid()
    triangle = 3 * (corner // 3)
    k = corner - triangle
    ahead, behind = k + 1, k + 2
    if ahead > 2:
        ahead = 0
    if behind > 2:
        behind = behind - 3
    opposite_out[start[places[corner]] + ranks[corner]] = wp.vec2i(places[triangle + ahead], places[triangle + behind])


@wp.func
def weighted_normal(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, scale: wp.float64):
    """Unit normal of a triangle times its angle at ``a``; zero if it has no area."""
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
    opposite: wp.array(dtype=wp.vec2i),
    # Out:
    normals_out: wp.array(dtype=wp.vec3),
    flags_out: wp.array(dtype=wp.uint8),  # FOLDED or CROWDED, and UNLIKE
):
    """Average the facets' normals about one place, and look for triangles that mirror each other, or are wound
    differently."""
    i = first + wp.tid()
    begin, end = start[i], start[i + 1]
    total = wp.vec3d()
    angles = wp.float64(0.0)
    fold = int(0)
    unlike = int(0)
    is_crowded = end - begin > FEW_CORNERS
    if is_crowded:
        fold = CROWDED
    for k in range(begin, end):
        pair = opposite[k]
        normal = weighted_normal(vertices[i], vertices[pair[0]], vertices[pair[1]], scale)
        total += normal
        angles += wp.length(normal)
        if not is_crowded:
            for other in range(begin, k):
                if opposite[other][0] == pair[0] or opposite[other][1] == pair[1]:
                    unlike = UNLIKE
                if opposite[other][0] == pair[1] and opposite[other][1] == pair[0]:
                    fold = FOLDED
    flags_out[i] = wp.uint8(fold | unlike)
    length = wp.length(total)
    if length > CANCELLED * angles:
        normals_out[i] = wp.vec3(float(total[0] / length), float(total[1] / length), float(total[2] / length))
    else:
        normals_out[i] = wp.vec3()


@dataclass(frozen=True, eq=False)
class _Smoothed:
    """Normals of the vertices, and of the corners at places where triangles mirror each other."""

    normals: np.ndarray
    """(n, 3) float32. Vertices of ``corners`` have theirs in ``side_normals`` instead."""
    corners: np.ndarray
    """(k,) int64, corner numbers, rising: 3 * triangle + 0, 1, 2."""
    sides: np.ndarray
    """(k,) int64, the side that each belongs to: a row of ``side_normals``."""
    side_normals: np.ndarray
    """(sides, 3) float32."""


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(n, 3) float32 unit normals of (n, 3) float64 vertices with (m, 3) int32 faces.

    Zero where undefined: where no triangle with an area meets, where those that meet cancel, and where one vertex
    serves several sides.

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
    """Normals of a mesh, whose vertices are doubled where one would serve several sides.

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
    """The normals of a mesh; vertices of different ``pieces``, (n,) numbers, are not welded."""
    corner_count = max(3 * len(faces), 2 * len(vertices))
    if corner_count > MOST_CORNERS:
        raise InputError(
            f"{len(faces)} triangles are too many for smooth normals, at most {MOST_CORNERS // 3} are allowed"
        )
    largest = max(float(vertices.max()), -float(vertices.min()))
    # By a power of two, so that nothing is rounded.
    scale = float(np.ldexp(1.0, -max(int(np.frexp(largest)[1]), SMALLEST_EXPONENT)))
    firsts = first_of_equals(vertices if pieces is None else np.column_stack([vertices, pieces]))
    places = np.ascontiguousarray(faces if firsts is None else firsts[faces])
    of_places, flags = _averaged(vertices, places, scale)
    turned = turned_triangles(places) if (flags & UNLIKE).any() else np.zeros(len(places), bool)
    if turned.any():
        places = np.where(turned[:, None], places[:, [0, 2, 1]], places)
        of_places, flags = _averaged(vertices, places, scale)
    of_vertices = of_places if firsts is None else of_places[firsts]
    is_suspect = (flags & (FOLDED | CROWDED)) > 0
    none = np.zeros(0, np.int64)
    if not is_suspect.any():
        return _Smoothed(of_vertices, none, none, np.zeros((0, 3), np.float32))
    corners, numbers, side_normals = sides_by_places(vertices * scale, places, is_suspect)
    triangle, k = np.divmod(corners, 3)
    corners = np.where(turned[triangle], 3 * triangle + (3 - k) % 3, corners)
    order = np.argsort(corners)
    return _Smoothed(of_vertices, corners[order], numbers[order], side_normals)


def _averaged(vertices: np.ndarray, places: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) float32 mean of the facets' normals about each place, and (n,) its flags, of (m, 3) triangles."""
    device = launch.resolve_device("cpu")
    shared = wp.array(places.reshape(-1), dtype=wp.int32, device=device, copy=False)
    start, ranks = bin_items(shared, len(vertices), device)
    opposite = wp.empty(places.size, dtype=wp.vec2i, device=device)
    launch.launch(list_corners, places.size, [shared, start, ranks, opposite], device)
    normals = wp.empty(len(vertices), dtype=wp.vec3, device=device)
    flags = wp.empty(len(vertices), dtype=wp.uint8, device=device)
    points = wp.array(vertices, dtype=wp.vec3d, device=device, copy=False)
    arguments = [points, wp.float64(scale), start, opposite, normals, flags]
    launch.launch(average_about_places, len(vertices), arguments, device)
    return normals.numpy(), flags.numpy()
