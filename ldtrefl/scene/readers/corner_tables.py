"""Faces by their corners: cut into triangles, and with a vertex doubled for each set of values that it is given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.piece import Piece
from ldtrefl.scene.readers.polygons import triangles_of
from ldtrefl.scene.welding import first_of_equals

CUTTING_BYTES = 250.0
"""What a triangle takes while faces are checked and cut; measured."""

SPLITTING_BYTES = 40.0
"""What a corner takes while corners are compared, besides twice its values; measured."""


def take_for_triangles(sizes: np.ndarray) -> None:
    """Ask for the memory to cut faces of so many corners.

    Raises:
        InputError: it is more than is allowed.
    """
    count = int(np.maximum(sizes.astype(np.int64) - 2, 0).sum())
    budget.take(CUTTING_BYTES * count, f"{count} triangles")


def check_vertices(corners: np.ndarray, sizes: np.ndarray, count: int) -> None:
    """Refuse faces of vertices that there are not.

    Args:
        corners: (corners,) vertex numbers, face by face.
        sizes: (faces,) corners of each.
        count: how many vertices there are.

    Raises:
        InputError: naming the first such face.
    """
    if len(corners) and (int(corners.min()) < 0 or int(corners.max()) >= count):
        wrong = int(np.argmax((corners < 0) | (corners >= count)))
        face = int(np.searchsorted(np.cumsum(sizes), wrong, side="right"))
        raise InputError(f"face {face} has vertex {corners[wrong]}, allowed are 0 to {count - 1}")


def cut_faces(points: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut faces into triangles; those of fewer than three corners have none.

    Args:
        points: (vertices, 3).
        corners: (corners,) vertex numbers, face by face.
        sizes: (faces,) corners of each.

    Returns:
        (m, 3) numbers of corners, and (m,) the face that each triangle is of.

    Raises:
        InputError: polygons that are not convex have too many corners.
    """
    if (sizes == 3).all():
        return np.arange(len(corners)).reshape(-1, 3), np.arange(len(sizes))
    is_polygon = sizes >= 3
    kept, counts = np.flatnonzero(np.repeat(is_polygon, sizes)), sizes[is_polygon].astype(np.int64)
    of_face = np.repeat(np.flatnonzero(is_polygon), counts - 2)
    if not len(kept):
        return np.zeros((0, 3), np.int64), of_face
    return kept[triangles_of(points[corners[kept]], counts)], of_face


def split_corners(faces: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of one vertex stay one where all their values are equal.

    Args:
        faces: (m, 3) numbers of vertices.
        values: (3 m, k) float, what each corner has.

    Returns:
        (n,) numbers of corners, one for each new vertex, in the order of the file, and (m, 3) faces of those.

    Raises:
        InputError: it takes more memory than is allowed.
    """
    budget.take((SPLITTING_BYTES + 16.0 * (values.shape[1] + 1)) * faces.size, f"{faces.size} corners of faces")
    firsts = first_of_equals(np.column_stack([faces.reshape(-1), values]).astype(np.float64))
    if firsts is None:
        every = np.arange(faces.size)
        return every, every.reshape(faces.shape)
    is_first = firsts == np.arange(len(firsts), dtype=firsts.dtype)
    numbers = np.cumsum(is_first) - 1
    return np.flatnonzero(is_first), numbers[firsts].reshape(faces.shape)


def with_vertices(piece: Piece, chosen: np.ndarray, faces: np.ndarray) -> Piece:
    """A piece with some of its vertices, each once or more often.

    Args:
        piece: it has no tangents and no second texture coordinates, which the kinds of files here do not store.
        chosen: (n,) numbers of its vertices.
        faces: (m, 3) numbers of those.
    """
    normals, uvs, colors = (None if of is None else of[chosen] for of in (piece.normals, piece.uvs, piece.colors))
    return replace(piece, vertices=piece.vertices[chosen], faces=faces, normals=normals, uvs=uvs, colors=colors)
