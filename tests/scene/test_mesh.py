"""Meshes: what they are made of is checked, and their keys are their content."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.scene.mesh import Part
from tests.part_materials import textured


def test_the_key_of_a_mesh_is_its_content() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces, normals, uvs = [[0, 1, 2], [1, 2, 3]], np.eye(4, 3), np.eye(4, 2)
    pixels = [np.full((2, 2, 3), value, np.uint8) for value in (1, 1, 2)]
    red, alike, other = (Part(0, textured(StoredPicture(entry), (1.0, 0.0, 0.0))) for entry in pixels)
    mesh = ldtrefl.Mesh(vertices, faces, normals, uvs, (red,))
    assert ldtrefl.Mesh(vertices.copy(), faces, normals, uvs, (alike,)).key == mesh.key
    assert ldtrefl.Mesh(vertices, faces, None, uvs, (red,)).with_normals(normals).key == mesh.key
    changed = [
        ldtrefl.Mesh(vertices + 1e-9, faces, normals, uvs, (red,)),
        ldtrefl.Mesh(vertices, faces[::-1], normals, uvs, (red,)),
        ldtrefl.Mesh(vertices, faces, -normals, uvs, (red,)),
        ldtrefl.Mesh(vertices, faces, None, uvs, (red,)),
        ldtrefl.Mesh(vertices, faces, normals, 2.0 * uvs, (red,)),
        ldtrefl.Mesh(vertices, faces, normals, uvs, (other,)),
        ldtrefl.Mesh(vertices, faces, normals, uvs, (red, Part(1))),
    ]
    assert len({entry.key for entry in (mesh, *changed)}) == 8
    assert [entry.surface_key == mesh.surface_key for entry in changed] == [False, False, True, True, True, True, True]


def test_normals_are_one_a_vertex() -> None:
    plane = shapes.make("plane", {})
    with pytest.raises(ldtrefl.InputError, match=f"3 normals for {len(plane.vertices)} vertices"):
        plane.with_normals(np.eye(3))


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int), "no triangles"),
        (np.eye(3), np.zeros((0, 3), int), "no triangles"),
        (np.eye(3), [[0, 1, 3]], r"triangle 0 has vertices \[0, 1, 3\], allowed are 0 to 2"),
        (np.eye(3), [[0, 1, 2], [0, -1, 2]], "triangle 1 has vertices"),
        (np.where(np.eye(3) > 0, np.nan, 0), [[0, 1, 2]], "vertex 0 is not finite"),
        (np.diag([1, np.inf, 1]), [[0, 1, 2]], "vertex 1 is not finite"),
        (np.eye(2), [[0, 1, 2]], r"vertices must have shape \(n, 3\), got \(2, 2\)"),
        (np.eye(3), [[0, 1]], r"faces must have shape \(n, 3\)"),
        (np.eye(3), [[0.5, 1, 2]], "whole numbers"),
        ("corner", [[0, 1, 2]], "vertices must be numbers"),
    ],
)
def test_wrong_arrays(vertices: object, faces: object, message: str) -> None:
    for maker in (ldtrefl.peel, ldtrefl.Raycaster):
        with pytest.raises(ldtrefl.InputError, match=message):
            maker(vertices, faces)
