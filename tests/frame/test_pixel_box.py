"""The box of pixels about a projected triangle, against every pixel of the band."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.pixel_box import EDGE_SLACK, GUARD, first_pixel, last_pixel, pixel_box

WIDTH, FIRST_ROW, END_ROW = 30, 8, 24


@launch.kernel
def find_boxes(
    first: int,
    # In:
    corners: wp.array2d(dtype=wp.vec3d),
    # Out: first x, last x, first y, last y
    box_out: wp.array(dtype=wp.vec4i),
    planar_out: wp.array(dtype=int),
):
    """Find the box of one triangle."""
    i = first + wp.tid()
    box = pixel_box(corners[i, 0], corners[i, 1], corners[i, 2], WIDTH, FIRST_ROW, END_ROW)
    box_out[i] = wp.vec4i(box.first_x, box.last_x, box.first_y, box.last_y)
    planar_out[i] = int(box.planar)


def boxes(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 4) boxes and (n,) whether they are planar, of (n, 3, 3) corners as ``projected`` gives them."""
    device, count = launch.resolve_device(None), len(corners)
    box, planar = wp.empty(count, dtype=wp.vec4i, device=device), wp.empty(count, dtype=int, device=device)
    given = wp.array(np.asarray(corners, float), dtype=wp.vec3d, device=device)
    launch.launch(find_boxes, count, [given, box, planar], device)
    return box.numpy(), planar.numpy() != 0


def pixels(box: np.ndarray) -> set[tuple[int, int]]:
    """The pixels (x, y) of a box."""
    return {(x, y) for x in range(box[0], box[1] + 1) for y in range(box[2], box[3] + 1)}


def test_a_box_holds_the_centres_within_the_corners() -> None:
    rng = np.random.default_rng(1)
    size = 10.0 ** rng.uniform(-2, 2, (500, 1, 1))
    corners = np.concatenate(
        [rng.uniform(-5, 35, (500, 1, 2)) + size * rng.normal(size=(500, 3, 2)), np.ones((500, 3, 1))], -1
    )
    # Some corners lie on centres, which belong to the box.
    corners[::3, :, :2] = np.floor(corners[::3, :, :2]) + 0.5
    found, planar = boxes(corners)
    assert planar.all()
    x, y = np.arange(WIDTH) + 0.5, np.arange(FIRST_ROW, END_ROW) + 0.5
    filled = 0
    for box, low, high in zip(found, corners.min(axis=1), corners.max(axis=1), strict=True):
        columns = np.flatnonzero((x >= low[0]) & (x <= high[0]))
        rows = FIRST_ROW + np.flatnonzero((y >= low[1]) & (y <= high[1]))
        assert pixels(box) == {(a, b) for a in columns.tolist() for b in rows.tolist()}
        filled += len(columns) * len(rows) > 0
    assert 100 < filled < 400


def test_triangles_without_bounds_take_the_band_unless_they_are_surely_outside() -> None:
    band = {(x, y) for x in range(WIDTH) for y in range(FIRST_ROW, END_ROW)}
    before, behind = (15.0, 15.0, 1.0), (-15.0, -15.0, -1.0)  # (x, y, 1 / depth); (x depth, y depth, depth)
    left, left_behind = (-5.0, 15.0, 1.0), (-9.0, 15.0, -1.0)
    far = (float(int(GUARD)) * 2.0, 15.0, 1.0)
    given = np.array(
        [
            [before, before, behind],  # crosses the camera's plane
            [behind, behind, behind],  # wholly behind
            [left, left, left_behind],  # crosses it, but to the left of the view
            [before, before, far],  # reaches beyond the guard
            [far, far, far],  # beyond the right side
        ]
    )
    found, planar = boxes(given)
    assert not planar.any()
    assert [pixels(box) for box in found] == [band, set(), set(), band, set()]


def test_the_first_and_last_pixel_of_an_interval() -> None:
    """Centres at +0.5; a bound that passes a centre by less than the slack does not lose it."""
    slack = float(EDGE_SLACK)
    for bound, expected in ((0.5, 0), (0.51, 1), (-0.5, -1), (3.0, 3), (0.5 + 0.5 * slack, 0), (0.5 + 2 * slack, 1)):
        assert first_pixel(wp.float64(bound)) == expected
        assert last_pixel(wp.float64(-bound)) == -expected - 1
