"""Triangles drawn row by row, against every pixel tested by itself in float64."""

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.frame.large_triangles import LARGE_BOX, none_set_aside
from ldtrefl.frame.projection import DrawnObject, chunks_of
from ldtrefl.frame.triangle_rows import Target
from ldtrefl.frame.zbuffer import draw_triangles
from ldtrefl.scene.description import Camera, Object
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.triangle_numbers import numbered
from tests.frame.drawing import gbuffer

WIDTH, FIRST_ROW, END_ROW = 60, 8, 48
"""A band of an image of 60 x 56 pixels. All of it is less than what is drawn in strips."""

NEAR_EDGE = 1e-7
"""Weight of a corner up to which a pixel is too near an edge to be held to an answer."""


def drawn(corners: np.ndarray) -> np.ndarray:
    """(rows, width) int64 keys of triangles, (n, 3, 3) (x, y, depth) in pixels."""
    device, count = launch.resolve_device(None), len(corners)
    depth = corners[..., 2:]
    before = np.concatenate([corners[..., :2], 1 / depth], -1)
    behind = np.concatenate([corners[..., :2] * depth, depth], -1)
    written = np.where(depth > 0, before, behind)  # as ``projected`` gives them
    written = written.reshape(-1, 3)
    record = ObjectRecord()
    record.faces = wp.array(np.arange(3 * count).reshape(-1, 3), dtype=wp.vec3i, device=device)
    chunks = chunks_of(np.array([count]), device)
    target, large = Target(), none_set_aside(device)
    target.keys = wp.zeros((END_ROW - FIRST_ROW) * WIDTH, dtype=wp.int64, device=device)
    target.width, target.first_row, target.end_row = WIDTH, FIRST_ROW, END_ROW
    objects = wp.array([record], dtype=ObjectRecord, device=device)
    drawn = wp.array([DrawnObject()], dtype=DrawnObject, device=device)
    known = [objects, drawn, numbered(np.array([count]), device), wp.array(written, dtype=wp.vec3d, device=device)]
    launch.launch(draw_triangles, chunks.shape[0], [chunks, *known, target, large], device)
    assert large.count.numpy()[0] == 0 and WIDTH * (END_ROW - FIRST_ROW) < int(LARGE_BOX)
    return target.keys.numpy().reshape(END_ROW - FIRST_ROW, WIDTH)


def nearness_of(keys: np.ndarray) -> np.ndarray:
    """1 / depth that the keys hold."""
    return (keys >> 32).astype(np.int32).view(np.float32)


def weights_at(corners: np.ndarray) -> np.ndarray:
    """(rows, width, 3) each corner's share of 1 / depth at every pixel's centre: all are positive inside."""
    depth = corners[:, 2:]
    columns = np.concatenate([corners[:, :2] * depth, depth], -1).T  # (x depth, y depth, depth) of each corner
    y, x = np.mgrid[FIRST_ROW:END_ROW, :WIDTH] + 0.5
    pixels = np.stack([x, y, np.ones_like(x)], axis=-1)
    return pixels @ np.linalg.inv(columns).T


def hold(corners: np.ndarray) -> int:
    """Compare one triangle with brute force; the number of its pixels."""
    keys, at = drawn(corners[None]), weights_at(corners)
    scale = np.abs(at).max(axis=-1)
    is_in, is_out = at.min(axis=-1) > NEAR_EDGE * scale, at.min(axis=-1) < -NEAR_EDGE * scale
    assert (keys[is_in] != 0).all(), f"a hole in {corners.tolist()}"
    assert (keys[is_out] == 0).all(), f"drawn beside {corners.tolist()}"
    np.testing.assert_allclose(nearness_of(keys)[is_in], at.sum(axis=-1)[is_in], rtol=1e-5)
    return int(is_in.sum())


@pytest.mark.parametrize("extent", [1.0, 2.5, 10.0, 60.0, 3e4])
def test_triangles_before_the_camera(extent: float) -> None:
    """From a pixel wide, which are drawn whole, to a thousand times the view; every other one is a sliver."""
    rng, pixels = np.random.default_rng(7), 0
    for turn in range(300):
        shape = rng.uniform(-extent, extent, (3, 2)) * (1.0, 1e-2 if turn % 2 else 1.0)
        corners = np.column_stack([shape + rng.uniform((10, 15), (50, 40)), rng.uniform(1, 3, 3)])
        pixels += hold(corners)
    assert pixels > 30


def test_triangles_that_cross_the_cameras_plane() -> None:
    rng, pixels = np.random.default_rng(8), 0
    for _ in range(80):
        corners = np.column_stack([rng.uniform(-60, 120, (3, 2)), rng.uniform(0.5, 3, 3) * rng.permutation([1, 1, -1])])
        pixels += hold(corners)
    assert pixels > 5000


def test_rows_are_cut_at_an_edge_through_pixel_centres() -> None:
    """Slope 1 through centres: the centres on the edge are covered from both sides, whatever rounding does to a cut."""
    upper = np.array([[10.5, 10.5, 1.0], [40.5, 40.5, 1.0], [40.5, 10.5, 1.0]])
    lower = np.array([[10.5, 10.5, 1.0], [10.5, 40.5, 1.0], [40.5, 40.5, 1.0]])
    on_edge = np.arange(11, 40)
    for corners in (upper, lower):
        assert (drawn(corners[None])[on_edge - FIRST_ROW, on_edge] != 0).all()


def test_the_nearest_triangle_counts_and_of_two_alike_the_larger_number() -> None:
    square = np.array([[0.0, 0.0], [60.0, 0.0], [0.0, 60.0]])
    depths = (3.0, 1.0, 2.0, 1.0)
    corners = np.stack([np.column_stack([square, np.full(3, depth)]) for depth in depths])
    for order in ([0, 1, 2, 3], [3, 1, 2, 0], [1, 3, 0, 2]):
        key = drawn(corners[order])[10, 10]
        expected = max(order.index(1), order.index(3))
        assert key & 0x7FFFFFFF == expected and nearness_of(np.array([key]))[0] == 1.0


def test_triangles_of_every_shape_cover_the_pixels_inside() -> None:
    camera = Camera(eye=(0, 0, 0), look_at=(0, 1, 0), fov_y=90, width=60, height=40)
    x, y = np.meshgrid(np.arange(60) + 0.5, np.arange(40) + 0.5)
    random = np.random.default_rng(5)
    for turn in range(60):
        # Of any size from two pixels to a thousand times the view, every other one flat, in front of the camera.
        extent = 10.0 ** random.uniform(0.3, 4.5)
        corners = random.uniform(-extent, extent, (3, 2)) * (1.0, 1e-3 if turn % 2 else 1.0) + random.uniform(5, 35, 2)
        depth = random.uniform(1, 3, 3)
        across, down = (corners[:, 0] / 20 - 1.5) * depth, (corners[:, 1] / 20 - 1.0) * depth
        mesh = ldtrefl.Mesh(np.stack([across, depth, -down], axis=1), np.array([[0, 1, 2]]))
        seen = gbuffer(camera, Object(mesh=mesh)).objects
        beside = []
        for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            along = (q - p) / np.linalg.norm(q - p)
            beside.append(along[0] * (y - p[1]) - along[1] * (x - p[0]))
        inside = np.maximum(np.min(beside, axis=0), -np.max(beside, axis=0))  # pixels from the nearest edge
        # Corners are kept in float32.
        assert (seen[inside > 1e-6 * extent + 1e-4] == 0).all() and (seen[inside < -1e-6 * extent - 1e-4] == -1).all()
