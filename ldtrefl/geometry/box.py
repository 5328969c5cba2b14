"""Boxes along the axes: a ray against one (the slab test), and the cells of a grid inside one.

The cells of a box are numbered from 0, along x first, then y, then z. A kernel visits them all so:

    for k in range(cell_count(box)):
        cell = cell_of_box(box, k)
"""

from __future__ import annotations

import warp as wp


@wp.func
def box_span(low: wp.vec3, high: wp.vec3, origin: wp.vec3, direction: wp.vec3) -> wp.vec2:
    """Slab test (Kay and Kajiya 1986): the values of t at which a ray enters and leaves a box, from 0 on.

    ``low`` and ``high`` are the box's corners. The ray misses the box if the first value is the larger. The direction
    need not have unit length.
    """
    t_enter = float(0.0)
    t_exit = float(wp.inf)
    for axis in range(3):
        if direction[axis] == 0.0:
            # 0 * inf would be NaN: a ray along the slab is inside it or never.
            if origin[axis] < low[axis] or origin[axis] > high[axis]:
                t_exit = -1.0
        else:
            t_low = (low[axis] - origin[axis]) / direction[axis]
            t_high = (high[axis] - origin[axis]) / direction[axis]
            t_enter = wp.max(t_enter, wp.min(t_low, t_high))
            t_exit = wp.min(t_exit, wp.max(t_low, t_high))
    return wp.vec2(t_enter, t_exit)


@wp.struct
class CellBox:
    """A box of whole cells of a grid. There are none in it if ``last`` is below ``first`` along any axis."""

    first: wp.vec3i  # the lowest cell along each axis
    last: wp.vec3i  # the highest one, which belongs to the box


@wp.func
def cell_count(box: CellBox) -> int:
    """The number of cells in a box."""
    size = wp.max(box.last - box.first + wp.vec3i(1, 1, 1), wp.vec3i(0, 0, 0))
    return size[0] * size[1] * size[2]


@wp.func
def cell_of_box(box: CellBox, k: int) -> wp.vec3i:
    """Cell ``k`` of a box, from 0 to ``cell_count(box) - 1``."""
    columns, rows = box.last[0] - box.first[0] + 1, box.last[1] - box.first[1] + 1
    row = k / columns
    layer = row / rows
    return box.first + wp.vec3i(k - row * columns, row - layer * rows, layer)


@wp.func
def cells_about(cell: wp.vec3i, grid: wp.vec3i) -> CellBox:
    """A cell and all that touch it, in a grid of ``grid`` cells along each axis."""
    box = CellBox()
    box.first = wp.max(cell - wp.vec3i(1, 1, 1), wp.vec3i(0, 0, 0))
    box.last = wp.min(cell + wp.vec3i(1, 1, 1), grid - wp.vec3i(1, 1, 1))
    return box


@wp.func
def cell_holding(x: float, cells: int) -> int:
    """The cell along an axis that holds a coordinate, in cells; the nearest of ``cells`` if none does."""
    return wp.clamp(int(wp.floor(x)), 0, cells - 1)


@wp.func
def cell_number(cell: wp.vec3i, grid: wp.vec3i) -> int:
    """The number of a cell among all of a grid, along x first, then y, then z."""
    return (cell[2] * grid[1] + cell[1]) * grid[0] + cell[0]
