"""The orthographic rasteriser: every texel once by the top-left rule, and values that are linear over a triangle."""

import numpy as np
import pytest
import warp as wp
from scipy.spatial import Delaunay

from ldtrefl.device import launch
from ldtrefl.geometry.fixed_raster import (
    SUBTEXEL_BITS,
    cover,
    first_centre,
    fixed_triangle,
    interpolate,
    last_centre,
    snap,
    unsnap,
)

SIDE = 16
"""Texels along a side of the map."""


@launch.kernel
def draw_triangles(
    first: int,
    # In:
    corners: wp.array2d(dtype=wp.vec2),
    values: wp.array2d(dtype=float),
    # Out:
    counts_out: wp.array2d(dtype=int),
    values_out: wp.array2d(dtype=float),
):
    """Each thread draws one triangle. Launched in order: they write the same texels."""
    i = first + wp.tid()
    a, b, c = corners[i, 0], corners[i, 1], corners[i, 2]
    tri = fixed_triangle(
        int(snap(a[0])), int(snap(a[1])), int(snap(b[0])), int(snap(b[1])), int(snap(c[0])), int(snap(c[1])), SIDE, SIDE
    )
    if tri.area != wp.int64(0):
        for v in range(tri.first_v, tri.last_v + 1):
            for u in range(tri.first_u, tri.last_u + 1):
                at = cover(tri, u, v)
                if at.covered:
                    counts_out[v, u] = counts_out[v, u] + 1
                    values_out[v, u] = interpolate(tri, at, values[i, 0], values[i, 1], values[i, 2])


@launch.kernel
def convert_coordinates(
    first: int,
    # In:
    x: wp.array(dtype=float),
    # Out:
    snapped_out: wp.array(dtype=int),
    back_out: wp.array(dtype=float),
    first_out: wp.array(dtype=int),
    last_out: wp.array(dtype=int),
):
    """Each thread converts one coordinate."""
    i = first + wp.tid()
    snapped_out[i] = int(snap(x[i]))
    back_out[i] = unsnap(snapped_out[i])
    first_out[i] = first_centre(snapped_out[i])
    last_out[i] = last_centre(snapped_out[i])


def drawn(corners: np.ndarray, values: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """(times that each texel is covered, its last value) of triangles (n, 3, 2); row v, column u."""
    device = launch.resolve_device(None)
    corners = np.asarray(corners, np.float32)
    values = np.zeros(corners.shape[:2]) if values is None else values
    counts, found = wp.zeros((SIDE, SIDE), dtype=int, device=device), wp.zeros((SIDE, SIDE), dtype=float, device=device)
    given = [wp.array(corners, dtype=wp.vec2, device=device), wp.array(values, dtype=float, device=device)]
    launch.launch_in_order(draw_triangles, len(corners), [*given, counts, found], device)
    return counts.numpy(), found.numpy()


def test_coordinates_in_fixed_point() -> None:
    step = 0.5 ** int(SUBTEXEL_BITS)
    x = np.array([0.0, 0.5, 0.5 + step, 0.5 - step, 3.49, 4095.5, -0.5, 1.4 * step, -1.4 * step], np.float32)
    device = launch.resolve_device(None)
    whole = [wp.zeros(len(x), dtype=int, device=device) for _ in range(3)]
    back = wp.zeros(len(x), dtype=float, device=device)
    inputs = [wp.array(x, dtype=float, device=device), whole[0], back, whole[1], whole[2]]
    launch.launch(convert_coordinates, len(x), inputs, device)
    np.testing.assert_array_equal(whole[0].numpy(), np.round(x.astype(float) / step))
    np.testing.assert_allclose(back.numpy(), x, atol=0.5 * step)
    np.testing.assert_array_equal(whole[1].numpy(), [0, 0, 1, 0, 3, 4095, -1, 0, 0])
    np.testing.assert_array_equal(whole[2].numpy(), [-1, 0, 0, -1, 2, 4095, -1, -1, -1])


def test_centres_on_an_edge_belong_to_one_side_by_the_top_left_rule() -> None:
    """A square whose four sides go through centres: two of its sides are its own."""
    square = np.array([[2.5, 2.5], [6.5, 2.5], [6.5, 6.5], [2.5, 6.5]])
    counts, _ = drawn(square[[[0, 1, 2], [0, 2, 3]]])
    assert counts.max() == 1 and counts.sum() == 16
    rows, columns = np.nonzero(counts)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (2, 5, 2, 5)


@pytest.mark.parametrize("steps", [2, 4, 1000])
@pytest.mark.parametrize("seed", range(4))
def test_a_triangulation_covers_every_texel_once(steps: int, seed: int) -> None:
    """Corners on a grid of ``1 / steps`` texel, so that edges and corners meet centres; both orientations."""
    rng = np.random.default_rng(seed)
    border = [[-1, -1], [-1, SIDE + 1], [SIDE + 1, -1], [SIDE + 1, SIDE + 1]]
    points = np.unique(np.r_[border, np.round(rng.uniform(0, SIDE, (60, 2)) * steps) / steps], axis=0)
    triangles = Delaunay(points).simplices
    turned = rng.random(len(triangles)) < 0.5
    triangles[turned] = triangles[turned][:, ::-1]
    counts, _ = drawn(points[triangles])
    np.testing.assert_array_equal(counts, 1)


def test_a_triangle_between_centres_covers_nothing() -> None:
    for corners in ([[3.6, 3.6], [4.4, 3.6], [4.0, 4.4]], [[1, 1], [5, 5], [9, 9]], [[2.5, 2.5]] * 3, [[-9, 0]] * 3):
        counts, _ = drawn(np.array([corners]))
        assert not counts.any()


@pytest.mark.parametrize("order", [[0, 1, 2], [0, 2, 1], [2, 0, 1]])
def test_values_are_linear_over_a_triangle(order: list[int]) -> None:
    corners, values = np.array([[0.25, 1.0], [15.5, 3.75], [4.0, 14.125]]), np.array([3.0, -2.0, 10.0])
    counts, found = drawn(corners[order][None], values[order][None])
    plane = np.linalg.solve(np.c_[corners, np.ones(3)], values)
    v, u = np.nonzero(counts)
    assert len(u) > 50
    np.testing.assert_allclose(found[v, u], np.c_[u + 0.5, v + 0.5, np.ones(len(u))] @ plane, rtol=1e-6, atol=1e-6)


def test_values_stay_in_the_range_of_the_corners() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        corners, value = rng.uniform(0, SIDE, (1, 3, 2)), np.float32(rng.normal())
        counts, found = drawn(corners, np.full((1, 3), value))
        np.testing.assert_array_equal(found[counts > 0], value)
