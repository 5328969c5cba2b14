"""Smooth normals: welded by equality alone, weighted by angle, averaged by side, the same for any number of threads."""

from collections.abc import Callable

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.normals import split_by_side, vertex_normals
from tests.conftest import REAL_MESHES
from tests.scene.sheets import plain_mean, sheet

SCANS_WITH_FOLDS = {"happy_buddha.ply": 600}
"""Meshes in which some triangles lie on their mirror images: how many corners may differ from a plain mean."""

SLIVERS = {"mosquito_in_amber.ply": 10, "gyroid": 150}
"""Meshes with triangles that trimesh leaves out as too small, by their size: how many corners may differ."""


@pytest.mark.parametrize("name", [*shapes.names(), *REAL_MESHES])
def test_normals_are_those_of_an_outside_program(mesh_or_shape: Callable, name: str) -> None:
    mesh = mesh_or_shape(name)
    normals = vertex_normals(mesh.vertices, mesh.faces)
    differs = np.abs(normals - plain_mean(mesh.vertices, mesh.faces)).max(axis=1) > 1e-6
    assert differs[mesh.faces].sum() <= {**SCANS_WITH_FOLDS, **SLIVERS}.get(name, 0)


def test_bits_do_not_depend_on_threads() -> None:
    vertices, faces = sheet(60)
    faces = np.random.default_rng(0).permutation(faces)
    found = []
    for threads in (1, 2, 5):
        ldtrefl.set_threads(threads)
        found.append(vertex_normals(vertices, faces.astype(np.int32)))
    assert np.array_equal(found[0], found[1]) and np.array_equal(found[0], found[2])


@pytest.mark.parametrize("scale", [1e-200, 1e-20, 1.0, 1e20, 1e99])
def test_normals_at_any_scale(scale: float) -> None:
    vertices, faces = sheet()
    found = vertex_normals(vertices * scale, faces.astype(np.int32))
    np.testing.assert_allclose(found, vertex_normals(vertices, faces.astype(np.int32)), atol=1e-6)


def test_small_triangles_keep_their_normals_beside_a_large_one() -> None:
    vertices, faces = sheet()
    far = np.array([[0, 0, 0], [1e9, 0, 0], [0, 1e9, 0]]) + 5e9
    found = vertex_normals(np.concatenate([vertices, far]), np.append(faces, [[169, 170, 171]], 0).astype(np.int32))
    np.testing.assert_allclose(found[:-3], vertex_normals(vertices, faces.astype(np.int32)), atol=1e-6)


def test_degenerate_triangles_do_no_harm() -> None:
    vertices, faces = sheet()
    wanted = vertex_normals(vertices, faces.astype(np.int32))
    points = np.stack([faces[:, 0], faces[:, 0], faces[:, 1]], 1)
    every = np.concatenate([faces, points, points[:, ::-1], np.repeat(faces[:, :1], 3, axis=1)]).astype(np.int32)
    sources, split, normals = split_by_side(vertices, every)
    assert np.array_equal(split, every) and len(sources) == len(vertices)
    np.testing.assert_allclose(normals, wanted, atol=1e-6)
