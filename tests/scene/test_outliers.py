"""Which triangles are outliers, and where the bulk of a mesh is."""

import numpy as np
from stress_cases import outliers

import ldtrefl
from ldtrefl.scene import shapes


def test_an_ordinary_mesh_has_no_outliers() -> None:
    for name in shapes.names():
        mesh = shapes.make(name)
        assert len(mesh.outliers) == 0 and mesh.bulk is mesh.bounds
    assert outliers.with_outlier("dust", 1e3).outliers.tolist() == [2 * 64 * 16]


def test_outliers_are_found_wherever_they_stand_and_the_bulk_is_the_rest() -> None:
    knot = shapes.make("torus_knot", {"segments": [200, 20]})
    n, m = len(knot.vertices), len(knot.faces)
    far = np.array([[0.0, 0.0, 300.0], [1.0, 0.0, 300.0], [0.0, 1.0, 300.0]])
    for places in ([0], [m], [0, 1023, 1024, 4095, 4096, m + 5], list(range(64))):
        faces = np.insert(knot.faces, np.array(places) - np.arange(len(places)), [n, n + 1, n + 2], axis=0)
        mesh = ldtrefl.Mesh(np.vstack([knot.vertices, far]), faces)
        assert mesh.outliers.tolist() == places
        assert np.array_equal(mesh.bulk, knot.bounds)
        assert mesh.bounds[1, 2] == 300.0
    faces = np.vstack([knot.faces, np.tile([n, n + 1, n + 2], (65, 1))])
    mesh = ldtrefl.Mesh(np.vstack([knot.vertices, far]), faces)
    assert len(mesh.outliers) == 0 and mesh.bulk is mesh.bounds


def test_of_triangles_that_all_reach_far_out_none_is_an_outlier() -> None:
    """The first corners lie together, the others do not: there is no bulk."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 100, 0], [0, 0, 100], [0, 100, 1], [1, 0, 100]], float)
    faces = np.array([[0, 2, 3], [1, 4, 5]])
    mesh = ldtrefl.Mesh(vertices, faces)
    assert len(mesh.outliers) == 0 and mesh.bulk is mesh.bounds
    for maker in (ldtrefl.peel, ldtrefl.Raycaster):
        hits = maker(vertices, faces).trace([[-5.0, 30.0, 30.0]], [[1.0, 0.0, 0.0]])
        assert hits.triangle.tolist() == [0] and abs(hits.t[0] - 5.0) < 1e-4
