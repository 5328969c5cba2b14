"""A triangle's normal; barycentrics: of its corners, inside it, beside it, off its plane, and where it has no area."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.triangle import ONE_THIRD, barycentrics_at, clamped_barycentrics, facet_normal, plane_coordinates

CORNERS = np.array([[1.0, 2.0, 3.0], [4.0, 2.5, 2.0], [0.5, 5.0, 3.5]])


@launch.kernel
def locate(
    first: int,
    # In:
    a: wp.vec3,
    b: wp.vec3,
    c: wp.vec3,
    points: wp.array(dtype=wp.vec3),
    # Out:
    plane_out: wp.array(dtype=wp.vec3),
    inside_out: wp.array(dtype=wp.vec2),
):
    """Each thread locates one point."""
    i = first + wp.tid()
    plane_out[i] = plane_coordinates(a, b, c, points[i])
    inside_out[i] = barycentrics_at(a, b, c, points[i])


@launch.kernel
def clamp_all(first: int, uv: wp.array(dtype=wp.vec2), clamped_out: wp.array(dtype=wp.vec2)):
    """Each thread moves one pair of barycentrics."""
    i = first + wp.tid()
    clamped_out[i] = clamped_barycentrics(uv[i][0], uv[i][1])


@launch.kernel
def find_normals(
    first: int,
    # In:
    corners: wp.array2d(dtype=wp.vec3d),
    # Out:
    normal_out: wp.array(dtype=wp.vec3d),
):
    """Each thread finds the normal of one triangle."""
    i = first + wp.tid()
    normal_out[i] = facet_normal(corners[i, 0], corners[i, 1], corners[i, 2])


def test_the_normal_of_a_slim_triangle_and_of_none() -> None:
    """The first is a ten millionth as wide as it is long."""
    slim = [[1, 1, 0], [2, 2, 0], [2, 2, 1e-7]]
    line = [[0, 0, 0], [1, 2, 3], [2, 4, 6]]
    device = launch.resolve_device(None)
    corners = wp.array(np.array([slim, slim[::-1], line], float), dtype=wp.vec3d, device=device)
    normal = wp.zeros(3, dtype=wp.vec3d, device=device)
    launch.launch(find_normals, 3, [corners, normal], device)
    aside = np.sqrt(0.5)
    np.testing.assert_allclose(normal.numpy(), [[aside, -aside, 0], [-aside, aside, 0], [0, 0, 0]], atol=1e-15)


def located(corners: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(``plane_coordinates``, ``barycentrics_at``) of points."""
    device = launch.resolve_device(None)
    plane = wp.zeros(len(points), dtype=wp.vec3, device=device)
    inside = wp.zeros(len(points), dtype=wp.vec2, device=device)
    given = [*(wp.vec3(*corner) for corner in corners), wp.array(points, dtype=wp.vec3, device=device)]
    launch.launch(locate, len(points), [*given, plane, inside], device)
    return plane.numpy(), inside.numpy()


def points_at(uv: np.ndarray) -> np.ndarray:
    """The points of these barycentrics."""
    return np.c_[1 - uv.sum(axis=1), uv] @ CORNERS


def test_points_of_the_plane_inside_and_outside() -> None:
    uv = np.random.default_rng(0).uniform(-2, 3, (500, 2))
    plane, inside = located(CORNERS, points_at(uv))
    np.testing.assert_allclose(plane[:, :2], uv, atol=1e-5)
    np.testing.assert_array_less(-1e-6, inside)
    assert (inside.sum(axis=1) < 1 + 1e-6).all()
    is_inside = (uv >= 0).all(axis=1) & (uv.sum(axis=1) <= 1)
    assert 10 < is_inside.sum()
    np.testing.assert_allclose(inside[is_inside], uv[is_inside], atol=1e-5)


def test_corners_and_centroid() -> None:
    points = np.r_[CORNERS, CORNERS.mean(axis=0, keepdims=True)]
    expected = [[0, 0], [1, 0], [0, 1], [float(ONE_THIRD)] * 2]
    for found in located(CORNERS, points):
        np.testing.assert_allclose(found[:, :2], expected, atol=1e-6)


def test_a_point_off_the_plane_is_projected() -> None:
    uv = np.array([[0.2, 0.3], [1.5, -0.25]])
    normal = np.cross(CORNERS[1] - CORNERS[0], CORNERS[2] - CORNERS[0])
    plane, _ = located(CORNERS, points_at(uv) + 0.3 * normal)
    np.testing.assert_allclose(plane[:, :2], uv, atol=1e-5)


@pytest.mark.parametrize("degrees", [90.0, 30.0, 150.0, 1.0])
def test_the_squared_sine_of_the_first_corner(degrees: float) -> None:
    angle = np.radians(degrees)
    corners = np.array([[0, 0, 0], [2, 0, 0], [3 * np.cos(angle), 3 * np.sin(angle), 0]])
    plane, _ = located(corners, corners[:1])
    assert plane[0, 2] == pytest.approx(np.sin(angle) ** 2, rel=1e-3)


def test_a_triangle_without_area() -> None:
    for corners in (CORNERS[[0, 0, 0]], CORNERS[[0, 1, 1]], np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]])):
        for found in located(corners, CORNERS):
            np.testing.assert_array_equal(found, 0.0)


def test_barycentrics_outside_move_into_the_triangle() -> None:
    uv = np.array([[-0.1, 0.5], [0.5, -0.1], [0.75, 0.75], [2.0, 0.0], [0.2, 0.3], [-1.0, -1.0]], np.float32)
    device = launch.resolve_device(None)
    found = wp.zeros(len(uv), dtype=wp.vec2, device=device)
    launch.launch(clamp_all, len(uv), [wp.array(uv, dtype=wp.vec2, device=device), found], device)
    expected = np.array([[0, 0.5], [0.5, 0], [0.5, 0.5], [1, 0], [0.2, 0.3], [0, 0]], np.float32)
    np.testing.assert_array_equal(found.numpy(), expected)
