"""Pieces moved: normals by the inverse transpose, and what is mirrored keeps its outside."""

import numpy as np

from ldtrefl.scene.piece import Piece, axes_left, moved, unit_vectors

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 1]])


def test_vectors_become_unit_vectors_or_none() -> None:
    stored = np.array([[3.0, 0, 4, 7], [0, 0, 0, 1], [np.nan, 1, 0, 0], [0, 1.0001, 0, 0]])
    expected = [[0.6, 0, 0.8, 7], [0, 0, 0, 1], [0, 0, 0, 0], [0, 1.0001, 0, 0]]
    np.testing.assert_allclose(unit_vectors(stored), expected)


def test_normals_stay_across_their_triangle() -> None:
    matrix = np.array([[2.0, 1, 0, 5], [0, -1, 0, 0], [0, 0.5, 3, 0], [0, 0, 0, 1]])  # it mirrors
    a, b, c = CORNERS
    normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
    piece = Piece(CORNERS, np.array([[0, 1, 2]]), np.tile(normal, (3, 1)), None)
    after = moved(piece, matrix)
    a, b, c = after.vertices[after.faces[0]]
    np.testing.assert_allclose(after.vertices, CORNERS @ matrix[:3, :3].T + [5, 0, 0])
    assert after.normals is not None
    facet = np.cross(b - a, c - a)
    np.testing.assert_allclose(after.normals[0], facet / np.linalg.norm(facet), atol=1e-12)


def test_what_is_flattened_has_the_normals_of_its_facets() -> None:
    """Stored ones of a body's two sides would cancel between them."""
    normals = np.array([[0.0, 0, 1], [0, 0, -1], [0, 1, 0]])
    tangents = np.tile([1.0, 0, 0, 1], (3, 1))
    flat = np.diag([1.0, 2, 0, 1])
    after = moved(Piece(CORNERS, np.array([[0, 1, 2]]), normals, None, tangents=tangents), flat)
    assert after.normals is not None and not after.normals.any() and after.tangents is None
    np.testing.assert_array_equal(after.vertices, [[0, 0, 0], [1, 0, 0], [0, 2, 0]])
    np.testing.assert_array_equal(after.faces, [[0, 1, 2]])


def test_axes_that_a_matrix_leaves() -> None:
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    expected = {(1, 2, 3): 3, (1e-5, 2, 3): 3, (0, 2, 3): 2, (1e-9, 2, 3): 2, (0, 0, 3): 1, (0, 0, 0): 0}
    for scales, axes in expected.items():
        assert axes_left(turn @ np.diag(scales) @ turn.T) == axes
