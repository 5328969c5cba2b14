"""Layered depth textures take copies of arrays and hand out copies."""

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
