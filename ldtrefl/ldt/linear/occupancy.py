"""What sorted maps imply about stretches of a ray, so that the linear search need not look at every sample.

Behind every fragment a map says inside or outside; ``inside`` holds which. Where as many fragments of a texel face up
as down, a ray is inside as long as those that it has passed do not cancel. Elsewhere it is inside if it has passed an
odd number of them. So where a texel's number of fragments is odd, a ray that goes up the axis and one that goes down
are told different things.

*Cells* are cubes of texels, at most ``MOST_CELLS`` along a side. They stand in columns along z: a bit a cell, a word a
column. Of each column there are two words: where *some* map may say inside, and where *some* map may say outside. Where
only one of the two has its bit set, the maps agree, and a ray changes nowhere in that cell. Coarser columns, 4 and 16
times as wide, hold what any of theirs holds (a pyramid). If any texel's number of fragments is odd, there is one such
occupancy for each octant of directions, else one for all. At 256 texels one takes 70 KB.

All of it is derived from the maps when they are made or read, by kernels over every texel and column that write places
of their own. Nothing of it is saved.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import warp as wp

from ldtrefl.device import launch
from ldtrefl.ldt.texel_frame import TexelFrame

INSIDE_UP, INSIDE_DOWN = wp.constant(1), wp.constant(2)
"""Bits of ``inside``: whether a ray that goes up, or down, the map's axis is inside behind the fragment."""

MOST_CELLS = 64
"""Cells along a side: as many as a word has bits. With half as many a search at 256 takes 12% longer."""

SMALLEST_SHIFT = 2
"""A cell is at least 2 to this power texels wide: coarse maps have small ones."""

LEVEL_SHIFT = 2
"""Columns of a level are 2 to this power as wide as those of the one below."""

COARSER = wp.constant(1 << LEVEL_SHIFT)
"""Columns of a level along a side of one of the next."""

OCTANTS = 8
"""Octants of directions: bit ``a`` of an octant's number is set where a ray goes down axis ``a``."""

MAY_BE_INSIDE, MAY_BE_OUTSIDE = wp.constant(0), wp.constant(1)
"""The two words of a column."""


@launch.kernel
def mark_inside(
    first: int,
    # In:
    start: wp.array(dtype=wp.int32),
    reference: wp.array(dtype=wp.int32),
    # Out:
    inside_out: wp.array(dtype=wp.uint8),
    odd_out: wp.array(dtype=wp.int32),  # 1 if a texel has an odd number, whoever writes it
):
    """A thread marks the fragments of one texel."""
    texel = first + wp.tid()
    begin, end = start[texel], start[texel + 1]
    rising = int(0)
    for k in range(begin, end):
        rising += reference[k] & 1
    is_balanced = 2 * rising == end - begin
    if (end - begin) % 2 == 1:
        odd_out[0] = 1
    wound = int(0)
    for k in range(begin, end):
        wound += 2 * (reference[k] & 1) - 1
        up, down = wound != 0, wound != 0
        if not is_balanced:
            up = (k + 1 - begin) % 2 == 1
            down = (end - k - 1) % 2 == 1
        inside_out[k] = wp.uint8(wp.where(up, INSIDE_UP, 0) + wp.where(down, INSIDE_DOWN, 0))


@wp.struct
class CellFrame:
    """The cells of a box of texels."""

    size: wp.vec3i  # texels along x, y, z
    first_texel: wp.vec3i
    cell_shift: int
    side: int  # cells along a side of the square of columns, and along any row


@wp.func
def cell_of(frame: CellFrame, axis: int, c: float) -> int:
    """The cell that holds a coordinate; what lies outside counts to the nearest."""
    return wp.clamp(int(c), 0, frame.size[axis] - 1) >> frame.cell_shift


@wp.func
def bits_between(low: int, high: int) -> wp.uint64:
    """Bits ``low`` to ``high``."""
    return (~wp.uint64(0) << wp.uint64(low)) & (~wp.uint64(0) >> wp.uint64(63 - high))


@launch.kernel
def mark_rows(
    first: int,
    # In:
    axis: int,
    start: wp.array(dtype=wp.int32),
    depth: wp.array(dtype=wp.float32),
    inside: wp.array(dtype=wp.uint8),
    frame: CellFrame,
    # Out: the words of rows of cells along the axis, by way (up, down), v and u
    rows_out: wp.array2d(dtype=wp.uint64),
):
    """A thread finds the words of one row of cells, for rays that go one way along it."""
    item = first + wp.tid()
    way = item / (frame.side * frame.side)
    columns, rows = frame.size[(axis + 1) % 3], frame.size[(axis + 2) % 3]
    width = 1 << frame.cell_shift
    u, v = width * (item % frame.side), width * (item / frame.side % frame.side)
    outside_bits, inside_bits = wp.uint64(0), wp.uint64(0)
    for row in range(v, wp.min(v + width, rows)):
        for column in range(u, wp.min(u + width, columns)):
            texel = frame.first_texel[axis] + row * columns + column
            begin, end = start[texel], start[texel + 1]
            is_inside = way == 1 and (end - begin) % 2 == 1
            low = int(0)
            for k in range(begin, end + 1):
                high = (frame.size[axis] - 1) >> frame.cell_shift
                if k < end:
                    high = cell_of(frame, axis, depth[k])
                bits = bits_between(low, high)
                if is_inside:
                    inside_bits |= bits
                else:
                    outside_bits |= bits
                low = high
                if k < end:
                    is_inside = (int(inside[k]) >> way) % 2 == 1
    rows_out[item, MAY_BE_INSIDE] = inside_bits
    rows_out[item, MAY_BE_OUTSIDE] = outside_bits


@launch.kernel
def columns_from_rows(
    first: int,
    # In:
    axis: int,  # 0 or 1
    rows: wp.array2d(dtype=wp.uint64),
    side: int,
    # Out: columns along z, by way, y and x
    columns_out: wp.array2d(dtype=wp.uint64),
):
    """A thread gathers one word of a column along z from the rows along another axis."""
    item = first + wp.tid()
    number = item / 2
    kind = item % 2
    way, x, y = number / (side * side), number % side, number / side % side
    # A row along x has its places by (y, z), one along y by (z, x).
    row, step, bit = way * side * side + y, side, x
    if axis == 1:
        row, step, bit = way * side * side + x * side, int(1), y
    word = wp.uint64(0)
    for z in range(side):
        word |= ((rows[row + z * step, kind] >> wp.uint64(bit)) & wp.uint64(1)) << wp.uint64(z)
    columns_out[number, kind] = word


@launch.kernel
def fill_columns(
    first: int,
    # In: the words of columns along z by each of the three maps, by way, y and x
    from_x: wp.array2d(dtype=wp.uint64),
    from_y: wp.array2d(dtype=wp.uint64),
    from_z: wp.array2d(dtype=wp.uint64),
    count: int,  # of the finest columns
    columns_per_octant: int,  # of all levels
    # Out:
    cells_out: wp.array2d(dtype=wp.uint64),
):
    """A thread joins what the three maps say of one word of a column, for one octant."""
    item = first + wp.tid()
    number = item / 2
    kind = item % 2
    octant, column = number / count, number % count
    word = from_x[(octant & 1) * count + column, kind]
    word |= from_y[((octant >> 1) & 1) * count + column, kind]
    word |= from_z[(octant >> 2) * count + column, kind]
    cells_out[octant * columns_per_octant + column, kind] = word


@launch.kernel
def join_columns(
    first: int,
    # In:
    below: int,  # the first column of the finer level
    above: int,  # and of this one
    side: int,  # of this one
    columns_per_octant: int,
    # In and out:
    cells: wp.array2d(dtype=wp.uint64),
):
    """A thread joins the words of finer columns to one word of a coarser one."""
    item = first + wp.tid()
    kind = item % 2
    number = item / 2
    octant, column = number / (side * side), number % (side * side)
    x, y = column % side, column / side
    place = octant * columns_per_octant
    word = wp.uint64(0)
    for v in range(COARSER * y, COARSER * y + COARSER):
        for u in range(COARSER * x, COARSER * x + COARSER):
            word |= cells[place + below + COARSER * side * v + u, kind]
    cells[place + above + column, kind] = word


@dataclass(frozen=True, eq=False)
class Occupancy:
    """What is derived from sorted maps, as this file says at its top."""

    inside: wp.array
    """(fragments,) uint8: ``INSIDE_UP`` and ``INSIDE_DOWN``."""
    cells: wp.array
    """(octants * columns, 2) uint64: the columns of all levels, the finest first; rows of x one after another."""
    octants: int
    """8, or 1 where one serves all."""
    cell_shift: int
    """A cell is 2 to this power texels wide."""
    sides: tuple[int, ...]
    """Of each level, columns along a side of the square in which they stand."""

    @property
    def nbytes(self) -> int:
        """Bytes of the arrays."""
        return int(self.inside.size + 8 * self.cells.size)

    @property
    def words_per_octant(self) -> int:
        """Words of ``cells`` that an octant has to itself; 0 if all octants share them."""
        return 0 if self.octants == 1 else self.cells.size // self.octants

    @property
    def column_shift(self) -> int:
        """The finest columns stand in a square that is 2 to this power wide."""
        return log2_up(self.sides[0])

    @property
    def first_columns(self) -> tuple[int, int, int]:
        """The first column of each of three levels; coarser levels than there are have none."""
        squares = [side * side for side in self.sides]
        return 0, sum(squares[:1]), sum(squares[:2])


def log2_up(n: int) -> int:
    """The exponent of the smallest power of two that is not below n."""
    return (n - 1).bit_length()


def occupancy_of(frame: TexelFrame, start: wp.array, depth: wp.array, reference: wp.array) -> Occupancy:
    """Derive what the sorted maps of a box of texels imply."""
    device = start.device
    inside = wp.empty(depth.shape[0], dtype=wp.uint8, device=device)
    is_odd = wp.zeros(1, dtype=wp.int32, device=device)
    launch.launch(mark_inside, start.shape[0] - 1, [start, reference, inside, is_odd], device)
    octants = OCTANTS if is_odd.numpy()[0] else 1

    cells, longest = CellFrame(), max(frame.size)
    cells.size, cells.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
    cells.cell_shift = max(SMALLEST_SHIFT, log2_up(-(-longest // MOST_CELLS)))
    column_shift = log2_up(-(-longest // (1 << cells.cell_shift)))
    side = cells.side = 1 << column_shift
    ways = 2 if octants > 1 else 1
    known = []
    for axis in range(3):
        rows = wp.empty((ways * side * side, 2), dtype=wp.uint64, device=device)
        launch.launch(mark_rows, ways * side * side, [axis, start, depth, inside, cells, rows], device)
        columns = rows
        if axis < 2:
            columns = wp.empty_like(rows)
            launch.launch(columns_from_rows, 2 * ways * side * side, [axis, rows, side, columns], device)
        known.append(columns)

    sides = tuple(side >> (LEVEL_SHIFT * level) for level in range(max(1, (column_shift + 1) // LEVEL_SHIFT)))
    count = sum(n * n for n in sides)
    made = wp.empty((octants * count, 2), dtype=wp.uint64, device=device)
    launch.launch(fill_columns, 2 * octants * side * side, [*known, side * side, count, made], device)
    below = 0
    for finer, n in itertools.pairwise(sides):
        above = below + finer * finer
        launch.launch(join_columns, 2 * octants * n * n, [below, above, n, count, made], device)
        below = above
    return Occupancy(inside, made, octants, cells.cell_shift, sides)
