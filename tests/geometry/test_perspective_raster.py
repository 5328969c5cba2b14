"""The perspective rasteriser: pixels and depths against rays solved in float64, and edges without cracks."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.perspective_raster import (
    highest,
    homogeneous_triangle,
    inverse_depth,
    lowest,
    perspective_weights,
    planar_nearness,
)

WIDTH, HEIGHT, FOCAL = 32, 24, 20.0
"""Of a camera at the origin that looks along +z: pixels, and pixels per tangent."""
NEAR_EDGE = 1e-6
"""Barycentric up to which a pixel is too near an edge for its answer to be held to."""


@launch.kernel
def draw_both_ways(
    first: int,
    # In:
    corners: wp.array(dtype=wp.vec3d),
    # Out, per pixel: 1 / depth, 0 outside
    homogeneous_out: wp.array2d(dtype=float),
    planar_out: wp.array2d(dtype=float),
):
    """Each thread tests one pixel in both ways."""
    i = first + wp.tid()
    row, column = i / WIDTH, i % WIDTH
    x, y = wp.float64(column) + wp.float64(0.5), wp.float64(row) + wp.float64(0.5)
    a, b, c = corners[0], corners[1], corners[2]
    tri = homogeneous_triangle(a, b, c)
    weights = perspective_weights(tri, x, y)
    zero, one = wp.float64(0.0), wp.float64(1.0)
    if lowest(weights[0], weights[1], weights[2]) >= zero and weights[0] + weights[1] + weights[2] > zero:
        homogeneous_out[row, column] = inverse_depth(tri, weights)
    if lowest(a[2], b[2], c[2]) > zero:
        image_a = wp.vec3d(a[0] / a[2], a[1] / a[2], one / a[2])
        image_b = wp.vec3d(b[0] / b[2], b[1] / b[2], one / b[2])
        image_c = wp.vec3d(c[0] / c[2], c[1] / c[2], one / c[2])
        planar_out[row, column] = planar_nearness(image_a, image_b, image_c, x, y)


@launch.kernel
def find_extremes(
    first: int,
    numbers: wp.array(dtype=wp.vec3d),
    low_out: wp.array(dtype=wp.float64),
    high_out: wp.array(dtype=wp.float64),
):
    """Each thread finds the extremes of three numbers."""
    i = first + wp.tid()
    low_out[i] = lowest(numbers[i][0], numbers[i][1], numbers[i][2])
    high_out[i] = highest(numbers[i][0], numbers[i][1], numbers[i][2])


def drawn(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(homogeneous, planar) 1 / depth of a triangle, 0 outside; corners (3, 3) in the camera's space."""
    x, y, z = corners.T
    pixels = np.stack([FOCAL * x + 0.5 * WIDTH * z, FOCAL * y + 0.5 * HEIGHT * z, z], axis=-1)
    device = launch.resolve_device(None)
    found = [wp.zeros((HEIGHT, WIDTH), dtype=float, device=device) for _ in range(2)]
    given = wp.array(pixels, dtype=wp.vec3d, device=device)
    launch.launch(draw_both_ways, HEIGHT * WIDTH, [given, *found], device)
    return found[0].numpy(), found[1].numpy()


def solved(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(least barycentric, 1 / depth) where each pixel's ray meets the triangle's plane; -1, 0 behind the camera."""
    column, row = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    rays = np.stack([(column - 0.5 * WIDTH) / FOCAL, (row - 0.5 * HEIGHT) / FOCAL, np.ones_like(row)], axis=-1)
    weights = np.linalg.solve(corners.T, rays.reshape(-1, 3).T).T.reshape(HEIGHT, WIDTH, 3)
    nearness = weights.sum(axis=-1)
    is_ahead = nearness > 0
    share = np.where(is_ahead, (weights / np.where(is_ahead, nearness, 1.0)[..., None]).min(axis=-1), -1.0)
    return share, np.where(is_ahead, nearness, 0.0)


@pytest.mark.parametrize("seed", range(30))
def test_pixels_and_depths_of_random_triangles(seed: int) -> None:
    """Some cross the camera's plane, some lie behind it; seen from the front and from the back."""
    rng = np.random.default_rng(seed)
    corners = rng.normal((0, 0, rng.choice([1.0, 4.0])), 2, (3, 3))
    share, nearness = solved(corners)
    homogeneous, planar = drawn(corners)
    inside, outside = share > NEAR_EDGE, share < -NEAR_EDGE
    found = [homogeneous, planar] if corners[:, 2].min() > 0 else [homogeneous]
    for picture in found:
        np.testing.assert_allclose(picture[inside], nearness[inside], rtol=1e-6)
        assert not picture[outside].any()


def test_a_wall_across_the_view_has_one_depth() -> None:
    for turn in (1, -1):
        wall = np.array([[-50.0, -50.0, 4.0], [50.0, -50.0, 4.0], [0.0, 90.0, 4.0]])[::turn]
        for picture in drawn(wall):
            np.testing.assert_array_equal(picture, np.float32(0.25))


def test_a_floor_that_goes_under_the_camera_ends_at_the_horizon() -> None:
    floor = np.array([[-1e3, 1.0, -1e3], [1e3, 1.0, -1e3], [0.0, 1.0, 4e3]])
    picture, _ = drawn(floor)
    tangent = (np.arange(HEIGHT) + 0.5 - 0.5 * HEIGHT) / FOCAL
    np.testing.assert_allclose(picture, np.repeat(np.maximum(tangent, 0)[:, None], WIDTH, axis=1), rtol=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_neighbours_leave_no_crack(seed: int) -> None:
    """A wall about a corner on a pixel, its edges through many pixels: every pixel is some triangle's."""
    rng = np.random.default_rng(seed)
    z = rng.uniform(1, 5)
    column, row = rng.integers(4, WIDTH - 4), rng.integers(4, HEIGHT - 4)
    hub = z * np.array([(column + 0.5 - 0.5 * WIDTH) / FOCAL, (row + 0.5 - 0.5 * HEIGHT) / FOCAL, 1.0])
    angles = np.linspace(0, 2 * np.pi, 9)
    rim = hub + 100 * np.stack([np.cos(angles), np.sin(angles), np.zeros(9)], axis=-1)
    rim[-1] = rim[0]
    fans = [drawn(np.stack([hub, rim[k], rim[k + 1]])) for k in range(8)]
    for way in range(2):
        assert (sum((fan[way] > 0).astype(int) for fan in fans) >= 1).all()


def test_triangles_that_cover_nothing() -> None:
    for corners in ([[0, 0, 3]] * 3, [[0, 0, 1], [0, 0, 2], [0, 0, 3]], [[-9, -9, -3], [9, -9, -3], [0, 9, -3]]):
        for picture in drawn(np.array(corners, float)):
            assert not picture.any()


def test_the_extremes_of_three_numbers() -> None:
    numbers = np.array([[1, 2, 3], [3, 1, 2], [2, 3, 1], [1, 1, 2], [-1, -1, -2], [5, 5, 5]], float)
    device = launch.resolve_device(None)
    low, high = (wp.zeros(len(numbers), dtype=wp.float64, device=device) for _ in range(2))
    given = wp.array(numbers, dtype=wp.vec3d, device=device)
    launch.launch(find_extremes, len(numbers), [given, low, high], device)
    np.testing.assert_array_equal(low.numpy(), numbers.min(axis=1))
    np.testing.assert_array_equal(high.numpy(), numbers.max(axis=1))
