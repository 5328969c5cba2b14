"""The point that sees all of a surface: known ones, and surfaces without any."""

import numpy as np
import pytest

from ldtrefl.methods.virtual.star_centre import star_centre
from ldtrefl.scene.shapes import make

RNG = np.random.default_rng(7)


def heights(point: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """How far a point is behind the planes of all triangles that have an area."""
    a, b, c = vertices[faces].swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    lengths = np.linalg.norm(across, axis=1)
    return np.einsum("ij,ij->i", a - point, across)[lengths > 0.0] / lengths[lengths > 0.0]


@pytest.mark.parametrize("flip", [False, True])
def test_a_convex_object_is_seen_from_the_middle_of_its_box(flip: bool) -> None:
    sphere = make("sphere")
    faces = sphere.faces[:, ::-1] if flip else sphere.faces
    centre = star_centre(sphere.vertices * [1.0, 2.0, 3.0] + [10.0, 0.0, -4.0], faces)
    assert np.allclose(centre, [10.0, 0.0, -4.0], atol=1e-12)


def test_a_point_is_found_that_is_neither_the_boxs_middle_nor_the_mean() -> None:
    # An arrow of four points, pulled up to an apex and down to another: it is seen from near its tip alone.
    outline = np.array([[0.0, 0.0], [1.0, -3.0], [0.0, -0.5], [-1.0, -3.0]])
    vertices = np.array([*np.c_[outline, np.zeros(4)], [0.0, -0.3, 0.2], [0.0, -0.3, -0.2]])
    faces = np.array([[i, (i + 1) % 4, apex] for i in range(4) for apex in (4, 5)])
    faces[1::2] = faces[1::2, ::-1]
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    assert np.ptp(np.sign(heights(middle, vertices, faces))) == 2.0
    centre = star_centre(vertices, faces)
    assert centre is not None
    assert np.ptp(np.sign(heights(centre, vertices, faces))) == 0.0


def test_a_sheet_is_seen_from_before_it() -> None:
    sheet = make("plane")
    centre = star_centre(sheet.vertices, sheet.faces)
    assert np.allclose(centre[:2], 0.0) and abs(centre[2]) > 0.5


def test_half_a_sphere_is_seen_from_inside() -> None:
    half = make("bowl", {"closed": False, "depth": 1.0})
    centre = star_centre(half.vertices, half.faces)
    signs = np.sign(heights(centre, half.vertices, half.faces))
    assert abs(signs.sum()) == len(signs)


@pytest.mark.parametrize(("name", "params"), [("torus", {}), ("bowl", {"closed": True}), ("hollow_box", {})])
def test_what_is_not_star_shaped_has_none(name: str, params: dict) -> None:
    mesh = make(name, params)
    assert star_centre(mesh.vertices, mesh.faces) is None


def test_triangles_without_area_do_not_count() -> None:
    sphere = make("sphere", {"segments": [16, 8]})
    flat = np.array([[0, 0, 5], [3, 3, 3]])
    with_flat = star_centre(sphere.vertices, np.concatenate([sphere.faces, flat]))
    assert np.allclose(with_flat, star_centre(sphere.vertices, sphere.faces))
    assert star_centre(sphere.vertices, flat) is None
