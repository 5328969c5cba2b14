"""Welding: rows are equal bit by bit, and by nothing less."""

import numpy as np

from ldtrefl.scene.normals import vertex_normals
from ldtrefl.scene.welding import first_of_equals


def test_equal_rows_are_found_by_their_bits() -> None:
    rng = np.random.default_rng(0)
    rows = rng.integers(0, 12, (5000, 3)).astype(float)
    rows[rng.random(rows.shape) < 0.3] *= -1.0  # many zeros of both signs
    rows[::7] += 1e-16  # lost, or not: 0 becomes another number
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    found = first_of_equals(rows)
    assert found is not None
    np.testing.assert_array_equal(found, first[inverse.reshape(-1)])
    assert first_of_equals(np.unique(rows, axis=0)) is None


def test_near_vertices_are_not_welded() -> None:
    """Two walls a hair apart, each flat: no normal is a mean of both."""
    near = np.nextafter(1.0, 2.0)
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [near, 0, 0], [near, 1, 0], [near, 0, 1]])
    normals = vertex_normals(vertices, np.array([[0, 1, 2], [3, 4, 5]], np.int32))
    np.testing.assert_allclose(normals, [[0, 0, 1]] * 3 + [[1, 0, 0]] * 3, atol=1e-12)
