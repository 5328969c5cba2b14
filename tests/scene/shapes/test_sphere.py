"""The sphere: its volume and Euler number."""

import numpy as np
import pytest

from ldtrefl.scene import shapes
from tests.scene.shapes.test_base import welded


def test_volume_and_euler_number() -> None:
    assert welded("sphere").euler_number == 2
    assert welded("sphere").volume == pytest.approx(4 / 3 * np.pi, rel=0.005)


def test_all_vertices_are_on_it() -> None:
    mesh = shapes.make("sphere", {"segments": [7, 5]})
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(mesh.normals, mesh.vertices, atol=1e-6)
