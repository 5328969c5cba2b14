"""Bilinear interpolation: pixels at their centres, planes between them, and what lies beyond the edges."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.bilinear import Neighbours, bilinear_blend, neighbours_clamped, neighbours_repeating

WIDTH, HEIGHT = 5, 3


@launch.kernel
def look_up(
    first: int,
    # In:
    picture: wp.array2d(dtype=wp.vec3),
    points: wp.array(dtype=wp.vec2),
    repeats: bool,
    # Out:
    colors_out: wp.array(dtype=wp.vec3),
    columns_out: wp.array(dtype=Neighbours),
):
    """Each thread looks up one point of a picture."""
    i = first + wp.tid()
    height, width = picture.shape[0], picture.shape[1]
    x, y = points[i][0], points[i][1]
    columns, rows = neighbours_clamped(x, width), neighbours_clamped(y, height)
    if repeats:
        columns = neighbours_repeating(x, width)
        rows = neighbours_repeating(y, height)
    columns_out[i] = columns
    colors_out[i] = bilinear_blend(
        columns,
        rows,
        picture[rows.before, columns.before],
        picture[rows.before, columns.after],
        picture[rows.after, columns.before],
        picture[rows.after, columns.after],
    )


def looked_up(picture: np.ndarray, points: np.ndarray, repeats: bool) -> tuple[np.ndarray, np.ndarray]:
    """(colours, ``Neighbours`` of the columns) at points (x, y) of a picture."""
    device = launch.resolve_device(None)
    colors = wp.empty(len(points), dtype=wp.vec3, device=device)
    columns = wp.empty(len(points), dtype=Neighbours, device=device)
    given = wp.array(picture, dtype=wp.vec3, device=device), wp.array(points, dtype=wp.vec2, device=device)
    launch.launch(look_up, len(points), [*given, repeats, colors, columns], device)
    return colors.numpy(), columns.numpy()


def noise() -> np.ndarray:
    return np.random.default_rng(0).random((HEIGHT, WIDTH, 3)).astype(np.float32)


def ramp() -> np.ndarray:
    """A picture whose channels are x, y and their sum."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    return np.stack([x, y, x + y], axis=-1)


@pytest.mark.parametrize("repeats", [False, True])
def test_a_pixels_centre_has_its_color(repeats: bool) -> None:
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    colors, columns = looked_up(noise(), np.stack([x.ravel(), y.ravel()], axis=-1), repeats)
    np.testing.assert_array_equal(colors, noise().reshape(-1, 3))
    np.testing.assert_array_equal(columns["before"], x.ravel())
    np.testing.assert_array_equal(columns["weight"], 0.0)


@pytest.mark.parametrize("repeats", [False, True])
def test_a_plane_stays_a_plane(repeats: bool) -> None:
    points = np.random.default_rng(1).uniform((0, 0), (WIDTH - 1, HEIGHT - 1), (200, 2)).astype(np.float32)
    colors, _ = looked_up(ramp(), points, repeats)
    np.testing.assert_allclose(colors, np.c_[points, points.sum(axis=1)], rtol=1e-6, atol=1e-6)


def test_the_edge_goes_on_where_it_is_clamped() -> None:
    outside = np.array([[-0.5, 1], [-1, 1], [WIDTH - 0.5, 1], [WIDTH, 1], [1, -0.5], [1, HEIGHT], [-9, -9]])
    colors, columns = looked_up(noise(), outside, False)
    nearest = np.clip(outside, 0, (WIDTH - 1, HEIGHT - 1)).astype(int)
    np.testing.assert_allclose(colors, noise()[nearest[:, 1], nearest[:, 0]], rtol=1e-6)
    assert (columns["before"] >= 0).all() and (columns["after"] < WIDTH).all()


def test_the_first_pixel_follows_the_last_where_it_repeats() -> None:
    picture = noise()
    across = np.array([[-0.5, 0], [WIDTH - 0.5, 0], [-0.25, 0], [0, -0.5], [0, HEIGHT - 0.5]])
    colors, columns = looked_up(picture, across, True)
    sides, ends = (picture[0, 0] + picture[0, -1]) / 2, (picture[0, 0] + picture[-1, 0]) / 2
    quarter = 0.25 * picture[0, -1] + 0.75 * picture[0, 0]
    np.testing.assert_allclose(colors, [sides, sides, quarter, ends, ends], rtol=1e-6)
    np.testing.assert_array_equal(columns["before"][:3], WIDTH - 1)
    np.testing.assert_array_equal(columns["after"][:3], 0)


@pytest.mark.parametrize("repeats", [False, True])
def test_a_picture_of_one_pixel_has_one_color(repeats: bool) -> None:
    picture = noise()[:1, :1]
    points = np.random.default_rng(2).uniform(-0.5, 0.5, (50, 2))
    colors, _ = looked_up(picture, points, repeats)
    np.testing.assert_allclose(colors, np.broadcast_to(picture[0, 0], (50, 3)), rtol=1e-6)
