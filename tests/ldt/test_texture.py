"""A layered depth texture: its layers, what is made only when it is asked for, and copies of arrays in and out."""

from collections.abc import Callable

import numpy as np
import pytest

import ldtrefl
from ldtrefl.ldt.maps import MapsView
from ldtrefl.scene import shapes

CUBE_ROUNDING = {"exact": 1e-6, "linear": 1e-3}
"""How far from a cube's face each search may find it: float32's rounding, and the paper's search, which halves a step
of a texel, 2 / 32, eight times, to 2e-4."""

MEAN_LAYERS = {
    # Mean surface crossings of the rays of a 128 x 128 grid that hit, along x, y and z: from the meshes' own listing,
    # made by another program.
    "armadillo.ply": (2.91, 2.81, 2.16),
    "happy_buddha.ply": (2.85, 4.84, 2.33),
    "lucy.ply": (2.98, 2.47, 4.33),
    "bunny_open.ply": (2.23, 2.44, 2.06),
    "boot.ply": (3.04, 2.41, 2.44),
    "teapot.ply": (4.36, 4.09, 3.86),
    "cycloidal_drive.ply": (10.19, 10.32, 7.95),
    "mosquito_in_amber.ply": (2.40, 2.50, 2.49),
    "sheen_chair.glb": (3.52, 2.58, 2.51),
    "dish_with_olives.glb": (6.18, 6.05, 6.27),
    "spot.glb": (2.30, 2.09, 2.34),
}


@pytest.mark.parametrize("name", sorted(MEAN_LAYERS))
def test_layers_of_real_meshes(real_mesh: Callable, name: str) -> None:
    mesh = real_mesh(name)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=128)
    means = [maps.counts(axis)[maps.counts(axis) > 0].mean() for axis in range(3)]
    np.testing.assert_allclose(means, MEAN_LAYERS[name], rtol=0.03)


def test_convex_objects_have_one_layer_and_shells_as_many_as_there_are() -> None:
    ball = shapes.make("sphere", {"segments": [48, 24]})
    assert set(ldtrefl.peel(ball.vertices, ball.faces, resolution=64).layers().values()) == {1}
    scales = np.linspace(0.5, 1.0, 40)
    vertices = np.concatenate([s * ball.vertices for s in scales])
    faces = np.concatenate([ball.faces + i * len(ball.vertices) for i in range(len(scales))])
    maps = ldtrefl.peel(vertices, faces, resolution=64)
    assert set(maps.layers().values()) == {40}
    assert maps.counts(0).max() == 80


def test_each_search_makes_what_it_reads_and_no_more() -> None:
    mesh = shapes.make("torus")
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, 32)
    tree_bytes = maps.nbytes
    assert maps.record_count == len(mesh.faces) and tree_bytes == maps.tree.nbytes
    fragments = maps.fragment_count  # counted, not made
    assert maps.record_count == len(mesh.faces)
    view = maps.view("linear")
    assert isinstance(view, type(MapsView())) and view.start.size == maps.frame.first_texels[3] + 1
    assert maps.fragment_count == fragments == maps.depth.size
    assert maps.record_count == len(mesh.faces) + fragments and maps.nbytes > tree_bytes


def test_unknown_searches_and_steps_are_refused() -> None:
    mesh = shapes.make("box")
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, 16)
    rays = [[0.0, 0.0, 5.0]], [[0.0, 0.0, -1.0]]
    with pytest.raises(ldtrefl.InputError, match=r"unknown search 'exakt'; did you mean 'exact'\?"):
        maps.trace(*rays, search="exakt")
    with pytest.raises(ldtrefl.InputError, match="linear_steps: should be 'texel' or a whole number from 1 to 100000"):
        maps.trace(*rays, search="linear", linear_steps=0)
    with pytest.raises(ldtrefl.InputError, match="binary_steps"):
        maps.occluded(*rays, search="linear", binary_steps=65)


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
    for search, rounding in CUBE_ROUNDING.items():
        hits = maps.trace(origins, directions, search=search)
        np.testing.assert_allclose(hits.t, [2.0, 6.0, 2.0, 1.0], atol=rounding)
        np.testing.assert_array_equal(hits.normal, [[1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, 1]])
