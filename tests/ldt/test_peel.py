"""Peeling: the same bits for any number of threads, and meshes that are flat, tiny or far."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes


def test_same_bits_for_any_number_of_threads() -> None:
    mesh = shapes.make("torus_knot")
    made = []
    for threads in (1, 2, 5):
        ldtrefl.set_threads(threads)
        maps = ldtrefl.peel(mesh.vertices, mesh.faces)
        made.append([x.numpy().copy() for x in (maps.start, maps.depth, maps.reference)])
    for other in made[1:]:
        for a, b in zip(made[0], other, strict=True):
            np.testing.assert_array_equal(a, b)


def test_flat_tiny_and_far_meshes() -> None:
    triangle = np.array([[0, 1, 2]])
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    for scale in (1e-6, 1.0, 1e6):
        for offset in (0.0, 1e6 * scale):
            maps = ldtrefl.peel(corners * scale + offset, triangle, resolution=32)
            assert maps.frame.size == (32, 32, 1)
            origin = np.array([[0.2 * scale + offset, 0.3 * scale + offset, 5 * scale + offset]])
            hit = maps.trace(origin, [[0, 0, -1]])
            height = float(np.float32(5 * scale + offset)) - offset  # rays start at places of float32
            assert hit.t[0] == pytest.approx(height, rel=1e-6)
    point = ldtrefl.peel(np.zeros((3, 3)), triangle)
    assert point.fragment_count == 0
    assert np.isposinf(point.trace([[0, 0, -1]], [[0, 0, 1]]).t).all()


def test_options_are_checked() -> None:
    mesh = shapes.make("box")
    for wrong in (
        {"resolution": 15},
        {"resolution": 4097},
        {"resolution": 64.0},
        {"quality": "best"},
        {"search": "no"},
    ):
        with pytest.raises(ldtrefl.InputError, match=next(iter(wrong))):
            ldtrefl.peel(mesh.vertices, mesh.faces, **wrong)
    assert ldtrefl.peel(mesh.vertices, mesh.faces, np.int64(16)).resolution == 16
