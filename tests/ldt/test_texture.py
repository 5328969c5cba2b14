"""Layered depth textures: hits on a cube, which are known on paper; arrays are taken and handed out as copies."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes


def test_vertices_that_are_handed_in_stay_the_callers() -> None:
    mesh = shapes.make("torus_knot", {"segments": [64, 12]})
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    maps, tree = ldtrefl.peel(vertices, faces, 64), ldtrefl.Raycaster(vertices, faces)
    given_mesh = ldtrefl.Mesh(vertices, faces)
    vertices[:], faces[:] = 0.0, 0
    origins = np.random.default_rng(1).normal(size=(500, 3)).astype(np.float32)
    origins *= 3.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    truth = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, -origins)
    linear = ldtrefl.peel(mesh.vertices, mesh.faces, 64).trace(origins, -origins, search="linear")
    np.testing.assert_array_equal(tree.trace(origins, -origins).t, truth.t)
    # Made only now, from what the maps hold of the mesh.
    np.testing.assert_array_equal(maps.trace(origins, -origins, search="linear").t, linear.t)
    np.testing.assert_array_equal(maps.geometry.mesh.vertices, mesh.vertices)
    np.testing.assert_array_equal(given_mesh.normals, ldtrefl.Mesh(mesh.vertices, mesh.faces).normals)


def test_maps_hand_out_copies() -> None:
    mesh = shapes.make("torus_knot", {"segments": [64, 12]})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, 64, search="linear")
    before = maps.layers(), maps.crossings()
    for array in (maps.start, maps.depth, maps.reference):
        array.numpy()[:] = 0
    assert (maps.layers(), maps.crossings()) == before
    for name in ("vertices", "faces", "normals", "uvs", "unit_vertices", "bounds"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(mesh, name)[...] = 0


def test_cube_is_hit_exactly() -> None:
    mesh = shapes.make("box")
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=32)
    origins = np.array([[5, 0.3, 0.2], [0.1, -7, 0.4], [-0.7, 0.9, 3], [0, 0, 0]], np.float32)
    directions = np.array([[-2, 0, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], np.float32)
    for search in ("linear", "exact"):
        hits = maps.trace(origins, directions, search=search)
        np.testing.assert_allclose(hits.t, [2.0, 6.0, 2.0, 1.0], atol=1e-3)
        np.testing.assert_array_equal(hits.normal, [[1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, 1]])
