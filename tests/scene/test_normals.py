"""Smooth normals: welded by equality alone, weighted by angle, averaged by side, the same for any number of threads."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.normals import split_by_side, vertex_normals
from ldtrefl.scene.welding import first_of_equals
from tests.conftest import REAL_MESHES

SCANS_WITH_FOLDS = {"happy_buddha.ply": 600}
"""Meshes in which some triangles lie on their mirror images: how many corners may differ from a plain mean."""

SLIVERS = {"mosquito_in_amber.ply": 10, "gyroid": 150}
"""Meshes with triangles that trimesh leaves out as too small, by their size: how many corners may differ."""


def plain_mean(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """trimesh's: vertices at one place welded, all faces there averaged by angle."""
    _, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    inverse = inverse.reshape(-1)
    centre, size = vertices.mean(axis=0), float(np.ptp(vertices, axis=0).max()) or 1.0
    welded = trimesh.Trimesh((vertices[first] - centre) / size, inverse[faces], process=False, validate=False)
    return np.nan_to_num(welded.vertex_normals[inverse])


def sheet(count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """A wavy sheet of 2 * count * count triangles."""
    x, y = np.meshgrid(*[np.linspace(0, 1, count + 1)] * 2)
    vertices = np.stack([x, y, 0.1 * np.sin(7 * x) * np.cos(5 * y)], -1).reshape(-1, 3)
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).reshape(-1)
    right, up = corner + 1, corner + count + 1
    return vertices, np.concatenate([np.stack([corner, right, up + 1], 1), np.stack([corner, up + 1, up], 1)])


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


@pytest.mark.parametrize("order", ["one after the other", "mixed"])
@pytest.mark.parametrize("shares_vertices", [True, False])
def test_a_sheet_modelled_twice_has_the_normals_of_either_side(shares_vertices: bool, order: str) -> None:
    vertices, faces = sheet()
    wanted = vertex_normals(vertices, faces.astype(np.int32))
    corners = np.concatenate([wanted[faces], -wanted[faces[:, ::-1]]])
    if shares_vertices:
        both, every = np.concatenate([faces, faces[:, ::-1]]), vertices
    else:
        both, every = np.concatenate([faces, faces[:, ::-1] + len(vertices)]), np.concatenate([vertices, vertices])
    if order == "mixed":
        moved = np.random.default_rng(0).permutation(len(both))
        both, corners = both[moved], corners[moved]
    sources, split, normals = split_by_side(every, both.astype(np.int32))
    np.testing.assert_array_equal(every[sources][split], every[both])
    np.testing.assert_allclose(normals[split], corners, atol=1e-6)


def test_sheets_that_meet_keep_their_sides() -> None:
    """Three sheets about one edge, each modelled twice, at 0, 90 and 180 degrees: in every space between two of them,
    the fronts that face each other make one side."""
    vertices = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0]], float)
    fronts = [[0, 1, 2], [0, 1, 3], [0, 1, 4]]
    faces = np.array([*fronts, *(face[::-1] for face in fronts)], np.int32)
    _, split, normals = split_by_side(vertices, faces)
    # [0, 1, 2] faces +y and meets the sheet at 90 degrees, and so on round; the lowest looks at the one at 180.
    half = round(float(np.sqrt(0.5)), 5)
    for face in range(6):
        a, b, c = vertices[faces[face]]
        outward = np.cross(b - a, c - a)
        for k in range(3):
            if faces[face, k] > 1:  # a border
                np.testing.assert_allclose(normals[split[face, k]], outward / np.linalg.norm(outward), atol=1e-6)
    ends = [(face, k) for face in range(6) for k in range(3) if faces[face, k] < 2]
    at_edge = {tuple(normals[split[face, k]].astype(float).round(5)) for face, k in ends}
    assert at_edge == {(half, half, 0.0), (-half, half, 0.0), (0.0, -1.0, 0.0)}


def test_two_boxes_that_touch_look_as_one() -> None:
    """What they share mirrors itself; no visible side may turn with it."""
    box = trimesh.creation.box()
    other = box.vertices + np.array([1.0, 0.0, 0.0])
    sources, split, normals = split_by_side(
        np.concatenate([box.vertices, other]), np.concatenate([box.faces, box.faces + 8]).astype(np.int32)
    )
    vertices = np.concatenate([box.vertices, other])[sources]
    on_seam = np.abs(vertices[split][..., 0] - 0.5) < 1e-9
    is_inside = on_seam.all(axis=1)
    seam = normals[split[~is_inside]][on_seam[~is_inside]]
    np.testing.assert_allclose(seam[:, 0], 0.0, atol=1e-6)


def test_a_vertex_that_serves_several_sides_has_no_normal() -> None:
    """In an array of one normal a vertex there is none that is right: the facets' are used."""
    vertices, faces = sheet()
    mesh = ldtrefl.Mesh(vertices, np.concatenate([faces, faces[:, ::-1]]))
    assert len(mesh.normals) == len(vertices) and not mesh.normals.any()


def test_ordinary_meshes_have_no_sides() -> None:
    """Neither open edges, nor faces wound against each other, nor triangles modelled twice the same way."""
    vertices, faces = sheet()
    rng = np.random.default_rng(0)
    wound = np.where(rng.random(len(faces))[:, None] < 0.3, faces[:, ::-1], faces)
    for some in (faces, wound, np.concatenate([faces, faces]), np.concatenate([faces, np.roll(faces, 1, axis=1)])):
        sources, split, normals = split_by_side(vertices, some.astype(np.int32))
        assert len(sources) == len(vertices) and np.array_equal(split, some)
        np.testing.assert_allclose(normals, plain_mean(vertices, some), atol=1e-6)


def test_a_fan_of_many_triangles_is_taken_in_one_go() -> None:
    """A cone of 100,000 triangles about its tip, and the same from inside: no pair by pair."""
    count = 100_000
    angle = 2 * np.pi * np.arange(count) / count
    vertices = np.concatenate([[[0, 0, 1]], np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)])
    rim = 1 + np.arange(count)
    cone = np.stack([np.zeros(count, int), rim, np.roll(rim, -1)], 1)
    _, split, normals = split_by_side(vertices, cone.astype(np.int32))
    np.testing.assert_allclose(normals[split[0, 0]], [0, 0, 1], atol=1e-6)
    _, split, normals = split_by_side(vertices, np.concatenate([cone, cone[:, ::-1]]).astype(np.int32))
    np.testing.assert_allclose([normals[split[0, 0]], normals[split[-1, 2]]], [[0, 0, 1], [0, 0, -1]], atol=1e-6)


def test_degenerate_triangles_do_no_harm() -> None:
    vertices, faces = sheet()
    wanted = vertex_normals(vertices, faces.astype(np.int32))
    points = np.stack([faces[:, 0], faces[:, 0], faces[:, 1]], 1)
    every = np.concatenate([faces, points, points[:, ::-1], np.repeat(faces[:, :1], 3, axis=1)]).astype(np.int32)
    sources, split, normals = split_by_side(vertices, every)
    assert np.array_equal(split, every) and len(sources) == len(vertices)
    np.testing.assert_allclose(normals, wanted, atol=1e-6)
