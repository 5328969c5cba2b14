"""Boxes: where rays enter and leave them by closed form, and every cell of a box once."""

import itertools

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.box import CellBox, box_span, cell_count, cell_holding, cell_number, cell_of_box, cells_about


@launch.kernel
def find_spans(
    first: int,
    # In:
    low: wp.vec3,
    high: wp.vec3,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    # Out:
    spans_out: wp.array(dtype=wp.vec2),
):
    """Each thread finds where one ray enters and leaves the box."""
    i = first + wp.tid()
    spans_out[i] = box_span(low, high, origins[i], directions[i])


@launch.kernel
def list_cells(
    first: int,
    # In:
    box: CellBox,
    # Out:
    count_out: wp.array(dtype=int),
    cells_out: wp.array(dtype=wp.vec3i),
):
    """One thread lists the cells of the box."""
    count_out[first + wp.tid()] = cell_count(box)
    for k in range(cell_count(box)):
        cells_out[k] = cell_of_box(box, k)


@launch.kernel
def find_boxes_about(
    first: int,
    # In:
    cells: wp.array(dtype=wp.vec3i),
    grid: wp.vec3i,
    # Out:
    boxes_out: wp.array(dtype=CellBox),
):
    """Each thread finds the box of cells about one cell."""
    i = first + wp.tid()
    boxes_out[i] = cells_about(cells[i], grid)


def spans(origins: object, directions: object) -> np.ndarray:
    """(n, 2) t of entry and exit, of rays through the box from (-1, -2, -3) to (1, 2, 3)."""
    device = launch.resolve_device(None)
    given = [wp.array(np.atleast_2d(rays), dtype=wp.vec3, device=device) for rays in (origins, directions)]
    found = wp.empty(len(given[0]), dtype=wp.vec2, device=device)
    launch.launch(find_spans, len(found), [wp.vec3(-1, -2, -3), wp.vec3(1, 2, 3), *given, found], device)
    return found.numpy()


def cells_in(first: tuple[int, ...], last: tuple[int, ...]) -> list[tuple[int, ...]]:
    """The cells of a box in the order in which a kernel visits them."""
    device = launch.resolve_device(None)
    box = CellBox()
    box.first, box.last = wp.vec3i(*first), wp.vec3i(*last)
    count, cells = wp.zeros(1, dtype=int, device=device), wp.zeros(1000, dtype=wp.vec3i, device=device)
    launch.launch(list_cells, 1, [box, count, cells], device)
    return [tuple(cell) for cell in cells.numpy()[: count.numpy()[0]].tolist()]


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_rays_along_an_axis(axis: int, sign: int) -> None:
    half = axis + 1.0
    origin, direction = np.array([0.5, 0.5, 0.5]), np.zeros(3)
    origin[axis], direction[axis] = -10.0 * sign, 2.0 * sign
    np.testing.assert_array_equal(spans(origin, direction), [[(10 - half) / 2, (10 + half) / 2]])
    origin[axis] = 0.0
    np.testing.assert_array_equal(spans(origin, direction), [[0.0, half / 2]])
    origin[(axis + 1) % 3] = 7.0
    (enter, leave), *_ = spans(origin, direction)
    assert enter > leave, "beside the box, whatever 0 * inf would be"


def test_a_ray_in_a_side_of_the_box_is_inside() -> None:
    np.testing.assert_array_equal(spans([1, -5, 0], [0, 1, 0]), [[3, 7]])


def test_rays_away_from_the_box_miss_it() -> None:
    enter, leave = spans([[3, 0, 0], [0, 3, 0], [2, 3, 0]], [[1, 0, 0], [0.1, 1, 0.1], [1, -1, 0]]).T
    assert (enter > leave).all()


def test_random_rays_agree_with_their_points() -> None:
    rng = np.random.default_rng(0)
    origins, directions = rng.uniform(-6, 6, (5000, 3)).astype(np.float32), rng.normal(size=(5000, 3))
    enter, leave = spans(origins, directions).astype(float).T
    hit = enter <= leave
    assert 0.1 < hit.mean() < 0.9
    half = np.array([1.0, 2.0, 3.0])
    for t in (enter, leave, 0.5 * (enter + leave)):
        points = (origins + t[:, None] * directions)[hit]
        assert (np.abs(points) <= half + 1e-4).all()
    # No point of a ray that misses lies inside.
    steps = np.linspace(0.0, 20.0, 400)[:, None, None]
    beside = origins[~hit][:200] + steps * directions[~hit][:200]
    assert (np.abs(beside) > half - 1e-4).any(axis=-1).all()


@pytest.mark.parametrize(
    ("first", "last"), [((0, 0, 0), (0, 0, 0)), ((2, 1, 5), (4, 1, 7)), ((-3, 0, 1), (1, 6, 2)), ((7, 7, 7), (7, 9, 7))]
)
def test_every_cell_of_a_box_once_along_x_first(first: tuple[int, ...], last: tuple[int, ...]) -> None:
    ranges = [range(low, high + 1) for low, high in zip(first, last, strict=True)]
    assert cells_in(first, last) == [(x, y, z) for z, y, x in itertools.product(*reversed(ranges))]


@pytest.mark.parametrize("axis", range(3))
def test_a_box_that_ends_before_it_begins_has_no_cells(axis: int) -> None:
    last = [3, 3, 3]
    last[axis] = 1
    assert cells_in((2, 2, 2), tuple(last)) == []


def test_cells_about_a_cell_stay_in_the_grid() -> None:
    device = launch.resolve_device(None)
    grid = (4, 1, 3)
    cells = np.array(list(itertools.product(*map(range, grid))))
    boxes = wp.empty(len(cells), dtype=CellBox, device=device)
    launch.launch(find_boxes_about, len(cells), [wp.array(cells, dtype=wp.vec3i), wp.vec3i(*grid), boxes], device)
    found = boxes.numpy()
    np.testing.assert_array_equal(found["first"], np.maximum(cells - 1, 0))
    np.testing.assert_array_equal(found["last"], np.minimum(cells + 1, np.array(grid) - 1))


@launch.kernel
def number_points(
    first: int,
    # In:
    points: wp.array(dtype=wp.vec3),
    grid: wp.vec3i,
    # Out:
    number_out: wp.array(dtype=int),
):
    """A thread finds the number of the cell that holds one point."""
    i = first + wp.tid()
    x, y, z = (
        cell_holding(points[i][0], grid[0]),
        cell_holding(points[i][1], grid[1]),
        cell_holding(points[i][2], grid[2]),
    )
    number_out[i] = cell_number(wp.vec3i(x, y, z), grid)


def test_points_are_numbered_by_the_nearest_cell() -> None:
    device, grid = launch.resolve_device(None), (4, 5, 3)
    points = np.random.default_rng(0).uniform(-1.0, 6.0, (500, 3)).astype(np.float32)
    numbers = wp.empty(500, dtype=int, device=device)
    launch.launch(
        number_points, 500, [wp.array(points, dtype=wp.vec3, device=device), wp.vec3i(*grid), numbers], device
    )
    cells = np.clip(np.floor(points).astype(int), 0, np.array(grid) - 1)
    np.testing.assert_array_equal(numbers.numpy(), np.ravel_multi_index(cells[:, ::-1].T, grid[::-1]))
