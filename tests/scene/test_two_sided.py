"""Sheets that were modelled twice: each side has its own normals, and ordinary meshes have no sides."""

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl.scene.normals import split_by_side, vertex_normals
from ldtrefl.scene.two_sided import triangles_with_image
from tests.scene.sheets import plain_mean, sheet


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
    """Neither open edges nor triangles modelled twice the same way."""
    vertices, faces = sheet()
    for some in (faces, np.concatenate([faces, faces]), np.concatenate([faces, np.roll(faces, 1, axis=1)])):
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


def test_triangles_with_an_image_are_found() -> None:
    """Whatever corner each starts with; the same triangle twice, and one that is near in numbers, are none."""
    places = [[0, 1, 2], [5, 6, 7], [2, 1, 0], [1, 3, 2], [4, 3, 2], [4, 3, 2], [6, 5, 7], [0, 1, 3], [7, 5, 6]]
    found = triangles_with_image(np.array(places, np.int32))
    assert found.tolist() == [True, True, True, False, False, False, True, False, True]
