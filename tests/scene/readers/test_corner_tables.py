"""Corners with values of their own: a vertex is doubled where they differ, and only there."""

import numpy as np

from ldtrefl.scene.piece import Piece
from ldtrefl.scene.readers.corner_tables import split_corners, with_vertices

FACES = np.array([[0, 1, 2], [0, 2, 3]])


def test_vertices_are_doubled_where_values_differ() -> None:
    values = np.array([[0.0], [0.0], [0.0], [0.0], [1.0], [0.0]])
    chosen, faces = split_corners(FACES, values)
    assert chosen.tolist() == [0, 1, 2, 4, 5] and faces.tolist() == [[0, 1, 2], [0, 3, 4]]
    chosen, faces = split_corners(FACES, np.arange(6.0)[:, None])
    assert chosen.tolist() == [*range(6)] and faces.tolist() == [[0, 1, 2], [3, 4, 5]]


def test_all_that_vertices_have_goes_with_them() -> None:
    vertices = np.arange(12.0).reshape(4, 3)
    piece = Piece(vertices, FACES, vertices + 1, vertices[:, :2].astype(np.float32))
    made = with_vertices(piece, np.array([3, 3, 0]), np.array([[0, 1, 2]]))
    np.testing.assert_array_equal(made.vertices, vertices[[3, 3, 0]])
    np.testing.assert_array_equal(made.normals, vertices[[3, 3, 0]] + 1)
    np.testing.assert_array_equal(made.uvs, vertices[[3, 3, 0], :2])
    assert made.colors is None and made.faces.tolist() == [[0, 1, 2]]
