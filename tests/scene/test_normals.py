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

WOUND_BOTH_WAYS = {"mosquito_in_amber.ply": 600}
"""Meshes of which some triangles are wound against those about them: in a plain mean their normals cancel."""

SLIVERS = {"mosquito_in_amber.ply": 10, "gyroid": 150}
"""Meshes with triangles that trimesh leaves out as too small, by their size: how many corners may differ."""


CANCELLING = {"mosquito_in_amber.ply": 16}
"""Meshes folded so sharply that at some vertices no normal is left, and how many."""


@pytest.mark.parametrize("name", [*shapes.names(), *REAL_MESHES])
def test_normals_are_those_of_an_outside_program(mesh_or_shape: Callable, name: str) -> None:
    mesh = mesh_or_shape(name)
    normals = vertex_normals(mesh.vertices, mesh.faces)
    differs = np.abs(normals - plain_mean(mesh.vertices, mesh.faces)).max(axis=1) > 1e-6
    has_none = mesh.is_used & ~normals.any(axis=1)
    assert np.count_nonzero(has_none) == CANCELLING.get(name, 0)
    differs &= ~has_none
    assert differs[mesh.faces].sum() <= {**SCANS_WITH_FOLDS, **SLIVERS, **WOUND_BOTH_WAYS}.get(name, 0)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.5])
def test_triangles_wound_against_each_other_have_the_normals_of_those_that_are_not(share: float) -> None:
    """But for the side of each part, here a closed knot and an open sheet."""
    knot, (vertices, faces) = shapes.make("torus_knot", {"segments": [96, 16]}), sheet()
    turned = np.random.default_rng(1).random(len(knot.faces) + len(faces)) < share
    alike = np.concatenate([knot.faces, len(knot.vertices) + faces])
    vertices = np.concatenate([knot.vertices, vertices])
    wound = np.where(turned[:, None], alike[:, ::-1], alike)
    expected, found = (vertex_normals(vertices, x.astype(np.int32)) for x in (alike, wound))
    for part in (slice(len(knot.vertices)), slice(len(knot.vertices), None)):
        assert np.array_equal(found[part], expected[part]) or (
            share == 0.5 and np.array_equal(found[part], -expected[part])
        )


def test_a_doubled_sheet_keeps_its_sides_beside_triangles_wound_against_each_other() -> None:
    """Corner numbers are those of the faces as they are given."""
    knot, (vertices, faces) = shapes.make("torus_knot", {"segments": [96, 16]}), sheet()
    wound = np.where(np.arange(len(knot.faces))[:, None] % 3 == 0, knot.faces[:, ::-1], knot.faces)
    doubled = np.concatenate([faces, faces[:, ::-1]]) + len(knot.vertices)
    every = np.concatenate([wound, doubled]).astype(np.int32)
    sources, split, normals = split_by_side(np.concatenate([knot.vertices, vertices]), every)
    assert np.array_equal(sources[split], every)
    np.testing.assert_array_equal(normals[: len(knot.vertices)], vertex_normals(knot.vertices, knot.faces))
    front, back = split[len(wound) : len(wound) + len(faces)], split[len(wound) + len(faces) :, ::-1]
    np.testing.assert_allclose(normals[front], -normals[back], atol=1e-6)
    np.testing.assert_allclose(normals[front], vertex_normals(vertices, faces.astype(np.int32))[faces], atol=1e-6)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_sides_that_are_cut_differently_have_no_normal_of_rounding(kind: type) -> None:
    """A flat sheet, turned, whose back is cut along the other diagonals: no triangle has a mirror image, and the mean
    of all about a vertex is 0."""
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    vertices, front = sheet()
    flat = (vertices * [1.0, 1.0, 0.0] @ turn).astype(kind).astype(float)
    a, b, c, d = front[: len(front) // 2, 0], *front[: len(front) // 2, 1:].T, front[len(front) // 2 :, 2]
    back = np.concatenate([np.stack([a, d, b], 1), np.stack([b, d, c], 1)])
    assert not vertex_normals(flat, np.concatenate([front, back]).astype(np.int32)).any()


def test_a_sharp_cone_keeps_the_normal_of_its_apex() -> None:
    """Of half an angle of 0.001 and of a thousand sides: its normals nearly cancel, and their mean is its axis."""
    turns = np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False)
    vertices = np.concatenate([[[0, 0, 1]], np.stack([1e-3 * np.cos(turns), 1e-3 * np.sin(turns), 0.0 * turns], 1)])
    around = np.arange(1, 1001)
    faces = np.stack([0 * around, around, np.roll(around, -1)], 1)
    np.testing.assert_allclose(vertex_normals(vertices, faces.astype(np.int32))[0], [0, 0, 1], atol=1e-6)


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
