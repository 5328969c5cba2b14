"""Which meshes are closed, and wound one way."""

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.scene import closed_check, shapes

SPHERE = shapes.make("sphere", {"segments": [48, 24]})
BOX = shapes.make("box")


def is_closed(vertices: np.ndarray, faces: np.ndarray) -> bool:
    given = wp.array(np.asarray(faces, np.int32), dtype=wp.vec3i, device="cpu")
    return closed_check.is_closed(np.asarray(vertices, float), given)


def together(*meshes: ldtrefl.Mesh) -> tuple[np.ndarray, np.ndarray]:
    firsts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = [mesh.faces + first for mesh, first in zip(meshes, firsts, strict=False)]
    return np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces)


def turned(faces: np.ndarray, *numbers: int) -> np.ndarray:
    changed = faces.copy()
    changed[list(numbers)] = changed[list(numbers)][:, ::-1]
    return changed


@pytest.mark.parametrize(
    ("shape", "expected"),
    [("sphere", True), ("box", True), ("torus_knot", True), ("hollow_box", True), ("room", True), ("plane", False)],
)
def test_shapes(shape: str, expected: bool) -> None:
    mesh = shapes.make(shape)
    assert is_closed(mesh.vertices, mesh.faces) == expected
    assert is_closed(mesh.vertices, mesh.faces[:, ::-1]) == expected


def test_one_triangle_that_is_missing_or_turned_is_found() -> None:
    knot = shapes.make("torus_knot", {"segments": [300, 40]})  # more triangles than are added up together
    assert len(knot.faces) > 4 * closed_check.AT_ONCE
    for mesh in (SPHERE, BOX, knot):
        for number in (0, len(mesh.faces) // 2, len(mesh.faces) - 1):
            assert not is_closed(mesh.vertices, np.delete(mesh.faces, number, axis=0))
            assert not is_closed(mesh.vertices, turned(mesh.faces, number))


def test_vertices_of_one_place_are_one_and_others_are_not() -> None:
    soup = SPHERE.vertices[SPHERE.faces].reshape(-1, 3)
    faces = np.arange(len(soup)).reshape(-1, 3)
    assert is_closed(soup, faces)
    moved = soup.copy()
    moved[0, 0] += 1e-9
    assert not is_closed(moved, faces)


def test_solids_that_share_what_they_like_are_closed() -> None:
    inside_out = ldtrefl.Mesh(0.5 * SPHERE.vertices, SPHERE.faces[:, ::-1])
    beside = ldtrefl.Mesh(BOX.vertices + np.array([2, 2, 0]), BOX.faces)  # they share an edge
    for solids in ((SPHERE, inside_out), (BOX, beside), (SPHERE, SPHERE)):
        assert is_closed(*together(*solids))
    without_area = np.concatenate([SPHERE.faces, [[3, 3, 7], [5, 5, 5]]])
    assert is_closed(SPHERE.vertices, without_area)
    assert not is_closed(*together(SPHERE, shapes.make("plane")))


def test_a_sheet_with_both_sides_is_closed() -> None:
    plane = shapes.make("plane")
    assert is_closed(plane.vertices, np.concatenate([plane.faces, plane.faces[:, ::-1]]))
    assert not is_closed(plane.vertices, np.concatenate([plane.faces, plane.faces]))
