"""The plane: its size, and where it faces."""

import numpy as np

from ldtrefl.scene import shapes


def test_it_faces_up() -> None:
    mesh = shapes.make("plane", {"segments": 3})
    assert len(mesh.faces) == 2 * 9
    np.testing.assert_array_equal(mesh.bounds, [[-1, -1, 0], [1, 1, 0]])
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (16, 1)))
