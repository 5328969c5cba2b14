"""Which meshes are solids: closed, with fronts outside, surface by surface."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.solid import is_solid

BOX = shapes.make("box")
SPHERE = shapes.make("sphere", {"segments": [24, 12]})


def together(*meshes: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    firsts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [faces + first for (_, faces), first in zip(meshes, firsts, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces).astype(np.int32)


def moved(mesh: ldtrefl.Mesh, scale: float, offset: float, *, turned: bool = False) -> tuple[np.ndarray, np.ndarray]:
    return scale * mesh.vertices + offset, mesh.faces[:, ::-1] if turned else mesh.faces


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        *((name, True) for name in ("sphere", "box", "torus_knot", "hollow_box", "wires")),
        *((name, False) for name in ("room", "plane", "teapot")),
    ],
)
def test_shapes(shape: str, expected: bool) -> None:
    """The fronts of a room's walls are inside; a plane is open, and so is the teapot, under its lid."""
    mesh = shapes.make(shape)
    assert is_solid(mesh.vertices, mesh.faces) == expected
    if expected:
        assert not is_solid(mesh.vertices, np.ascontiguousarray(mesh.faces[:, ::-1]))


def test_every_surface_counts_however_small_and_far_away() -> None:
    """Volumes of 1e-12 beside one of 8, a million sizes away from it."""
    for turned in (False, True):
        small = moved(SPHERE, 1e-4, 100.0, turned=turned)
        assert is_solid(*together(moved(BOX, 1.0, 0.0), small)) == (not turned)
        cavity = moved(SPHERE, 0.5, 0.0, turned=turned)
        assert is_solid(*together(moved(BOX, 1.0, 0.0), cavity)) == (not turned), "walls of a cavity may be looked at"


def test_a_hole_and_a_turned_triangle_are_found() -> None:
    assert not is_solid(SPHERE.vertices, SPHERE.faces[1:])
    faces = SPHERE.faces.copy()
    faces[5] = faces[5, ::-1]
    assert not is_solid(SPHERE.vertices, faces)


def test_a_sheet_with_both_sides_is_no_solid_and_triangles_without_area_do_not_count() -> None:
    plane = shapes.make("plane", {"segments": 7})
    bent = plane.vertices + np.array([0, 0, 1]) * np.sin(3.1 * plane.vertices[:, :1])
    assert not is_solid(bent, np.concatenate([plane.faces, plane.faces[:, ::-1]]))
    vertices, faces = together(moved(BOX, 1.0, 0.0), (np.full((3, 3), 7.0), np.array([[0, 1, 2]])))
    assert is_solid(vertices, faces)


def test_a_thin_plate_is_a_solid() -> None:
    assert is_solid(BOX.vertices * np.array([1.0, 1.0, 1e-7]), BOX.faces)
