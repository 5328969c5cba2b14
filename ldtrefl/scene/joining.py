"""Pieces of a mesh file -> one mesh, each piece a part of it.

Triangles stand in the order of the file, part by part. Normals that a file stores are used; pieces without any get
smooth ones, each piece by itself unless it continues another: the file says that they are not one surface.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.piece import Piece
from ldtrefl.scene.smoothing import BYTES_PER_TRIANGLE, BYTES_PER_VERTEX, smoothed

BYTES_PER_COLOR = 55.0
"""What a vertex takes besides if it has a colour; measured."""


def joining_bytes(pieces: list[Piece]) -> float:
    """Bytes that :func:`joined_mesh` takes, an estimate."""
    vertices, triangles = (sum(map(len, of)) for of in ([p.vertices for p in pieces], [p.faces for p in pieces]))
    colored = sum(len(piece.vertices) for piece in pieces if piece.colors is not None)
    return BYTES_PER_VERTEX * vertices + BYTES_PER_COLOR * colored + BYTES_PER_TRIANGLE * triangles


def joined_mesh(pieces: list[Piece]) -> Mesh:
    """One mesh of all pieces, each a part. Smooth normals are made where a piece has none, surface by surface.

    Raises:
        InputError: the pieces are no sound mesh, or a texture is damaged.
    """
    first_vertex = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    first_triangle = np.cumsum([0, *(len(piece.faces) for piece in pieces)]).tolist()
    vertices = np.concatenate([piece.vertices for piece in pieces])
    faces = np.concatenate([piece.faces for piece in pieces])
    if len(pieces) > 1:
        faces = faces + np.repeat(first_vertex[:-1], np.diff(first_triangle))[:, None]
    parts = tuple(Part(first, piece.material) for first, piece in zip(first_triangle[:-1], pieces, strict=True))
    mesh = Mesh(vertices, faces, None, _joined(pieces, "uvs", (0.0, 0.0)), parts, **_more_of_vertices(pieces))
    return _with_normals(mesh, pieces, first_vertex, first_triangle)


def _with_normals(mesh: Mesh, pieces: list[Piece], first_vertex: np.ndarray, first_triangle: list[int]) -> Mesh:
    """The mesh with the normals that its pieces store, and smooth ones for those that store none."""
    is_without = np.array([piece.normals is None for piece in pieces])
    stored = [np.zeros(piece.vertices.shape) if piece.normals is None else piece.normals for piece in pieces]
    normals = np.concatenate(stored).astype(np.float32)
    normals.flags.writeable = False  # and so it is not copied
    if not is_without.any():
        return mesh.with_normals(normals)
    surfaces = np.cumsum([not piece.continues for piece in pieces])
    number = np.repeat(surfaces, np.diff(first_vertex))
    triangles = np.flatnonzero(np.repeat(is_without, np.diff(first_triangle)))
    is_of = np.repeat(is_without, np.diff(first_vertex))
    return smoothed(mesh.with_normals(normals), is_of, triangles, number if surfaces[-1] > surfaces[0] else None)


def _more_of_vertices(pieces: list[Piece]) -> dict[str, np.ndarray | None]:
    """What vertices have beside positions, normals and texture coordinates."""
    return {
        "second_uvs": _joined(pieces, "second_uvs", (0.0, 0.0)),
        "colors": _joined(pieces, "colors", (1.0, 1.0, 1.0, 1.0)),
        "tangents": _joined(pieces, "tangents", (0.0, 0.0, 0.0, 0.0)),
    }


def _joined(pieces: list[Piece], name: str, otherwise: tuple[float, ...]) -> np.ndarray | None:
    """(n, width) float32 of all pieces, ``otherwise`` for those without; None if none has any."""
    found = [getattr(piece, name) for piece in pieces]
    if all(values is None for values in found):
        return None
    row = np.array(otherwise, np.float32)
    rest = [np.broadcast_to(row, (len(piece.vertices), len(row))) for piece in pieces]
    parts = [same if values is None else values for values, same in zip(found, rest, strict=True)]
    return np.concatenate(parts).astype(np.float32, copy=False)
