"""Records -> binary tree, on all cores.

    records -> cells -> parts of the cells by the surface area heuristic, on one thread
                     -> parts of the records of each group of cells, on all threads

Records are first sorted into a grid, so that the upper levels of the tree, which one thread builds, are found from a
few thousand cells. The lower levels of each group of cells are then built beside the others'. The splitting itself is
C++ (``binary_tree.h``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import bin_items
from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.box import cell_holding, cell_number
from ldtrefl.ldt.exact.records import Records, Reference, fetch_ahead, record_number, reference_to
from ldtrefl.ldt.exact.tree import LANES

CELLS_PER_ROOT = 0.13
"""Cells along the longest side per square root of the records, so that some twenty lie in an occupied one. From 0.08 to
0.2 trees are as fast, within 3%, and building takes as long."""
MOST_CELLS = 128
"""Cells along the longest side, at most."""
GROUP = wp.constant(512)
"""Records of a group of cells, unless one cell holds more: so many fit in a core's first cache."""
REFERENCE_BYTES = wp.constant(32)
"""Bytes of a ``Reference``."""
EMPTY = 1.0e30
"""Sides of a box with nothing in it: its low is above its high."""
SHORTEST = 1.0e-30
"""Length that no box that is split is shorter than: it is divided by."""


@wp.struct
class Node:
    """A node of a binary tree, as ``binary_tree.h`` has it."""

    low: wp.vec4  # and the bits of the number of a part, or of a leaf's first reference
    high: wp.vec4  # and those of the other part's, or of a leaf's ~count


@wp.struct
class Grid:
    """Cells that records are sorted into by the middles of their boxes.

    A record that is larger than a cell goes into a coarser grid, of cells twice as wide, and so on. So records of one
    cell are about as large as each other.
    """

    low: wp.vec3
    cells_per_unit: float  # of the finest grid
    size: wp.vec3i  # cells of the finest grid along x, y and z


@launch.kernel
def number_cells(
    first: int,
    # In:
    records: Records,
    grid: Grid,
    # Out:
    cell_out: wp.array(dtype=wp.int32),
):
    """A thread finds the cell of one record."""
    i = first + wp.tid()
    box = reference_to(records, record_number(records, i))
    per_unit, size = float(grid.cells_per_unit), wp.vec3i(grid.size)
    extent = per_unit * wp.max(box.high[0] - box.low[0], wp.max(box.high[1] - box.low[1], box.high[2] - box.low[2]))
    before = int(0)  # cells of finer grids
    while extent > 1.0 and wp.max(size) > 1:
        before += size[0] * size[1] * size[2]
        size = wp.vec3i((size[0] + 1) / 2, (size[1] + 1) / 2, (size[2] + 1) / 2)
        per_unit *= 0.5
        extent *= 0.5
    x = cell_holding(per_unit * (0.5 * (box.low[0] + box.high[0]) - grid.low[0]), size[0])
    y = cell_holding(per_unit * (0.5 * (box.low[1] + box.high[1]) - grid.low[1]), size[1])
    z = cell_holding(per_unit * (0.5 * (box.low[2] + box.high[2]) - grid.low[2]), size[2])
    cell_out[i] = before + cell_number(wp.vec3i(x, y, z), size)


@launch.kernel
def sort_by_cell(
    first: int,
    # In:
    records: Records,
    cell: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    # Out:
    record_out: wp.array(dtype=wp.int32),
):
    """A thread puts one record into its place in its cell."""
    i = first + wp.tid()
    record_out[start[cell[i]] + ranks[i]] = record_number(records, i)


@launch.kernel
def measure_cells(
    first: int,
    # In:
    records: Records,
    sorted_records: wp.array(dtype=wp.int32),
    occupied: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    # Out:
    reference_out: wp.array(dtype=Reference),
):
    """A thread finds the box about the records of one occupied cell."""
    i = first + wp.tid()
    begin, end = start[occupied[i]], start[occupied[i] + 1]
    made = reference_to(records, sorted_records[begin])
    for k in range(begin + 1, end):
        fetch_ahead(records, sorted_records, k)
        one = reference_to(records, sorted_records[k])
        made.low = wp.min(made.low, one.low)
        made.high = wp.max(made.high, one.high)
    made.low[3] = wp.cast(occupied[i], wp.float32)
    made.high[3] = float(end - begin)
    reference_out[i] = made


CONSTANTS = {"EMPTY": EMPTY, "SHORTEST": SHORTEST}
"""What the C++ reads, by the names that it has there."""
FILES = ("device/vectors.h", "ldt/exact/binary_tree.h")
"""The C++ of the splitting, each file after those that its class is derived from."""

SPLIT = """
    return BinaryTree::split_all(
        (BinaryTree::Reference*)references.data, count, most, are_records != 0, by_halves != 0,
        (BinaryTree::Node*)nodes.data + root, root + 1, first
    );
"""


@wp.func_native(native_body(CONSTANTS, FILES, SPLIT))
def split_all(
    references: wp.array(dtype=Reference),
    count: int,
    most: int,
    are_records: int,
    by_halves: int,
    nodes: wp.array(dtype=Node),
    root: int,
    first: int,
) -> wp.int32:
    """Split ``count`` references until at most ``most`` records are left together, and number them from ``first``.

    Nodes go to ``root`` and after it. Returns how many there are.
    """
    ...


@launch.kernel
def split_cells(
    first: int,
    # In and out:
    cells: wp.array(dtype=Reference),
    # In:
    by_halves: int,
    # Out:
    nodes_out: wp.array(dtype=Node),
    count_out: wp.array(dtype=wp.int32),
):
    """The only thread builds the upper levels of the tree, whose leaves are groups of cells."""
    count_out[0] = split_all(cells, cells.shape[0], GROUP, 0, by_halves, nodes_out, 0, 0)


@wp.struct
class SortedRecords:
    """Records in the order of their cells."""

    records: Records
    numbers: wp.array(dtype=wp.int32)
    start: wp.array(dtype=wp.int32)  # first of each cell
    cells: wp.array(dtype=Reference)  # those that are occupied, in the order of the upper levels' leaves


@wp.struct
class Group:
    """A leaf of the upper levels: some cells, and where what is made of their records goes."""

    node: int
    first_cell: int
    cell_count: int
    first_record: int  # in the order of the leaves
    record_count: int
    first_spilled: int  # of a group too large for the stack: where its references stand in the array beside it


@wp.func
def gather_references(given: SortedRecords, group: Group, references_out: wp.array(dtype=Reference)):
    """Make references to the records of a group."""
    at = int(0)
    for k in range(group.first_cell, group.first_cell + group.cell_count):
        cell = wp.cast(given.cells[k].low[3], wp.int32)
        for i in range(given.start[cell], given.start[cell + 1]):
            fetch_ahead(given.records, given.numbers, i)
            references_out[at] = reference_to(given.records, given.numbers[i])
            at += 1


@launch.kernel
def split_groups(
    first: int,
    # In:
    given: SortedRecords,
    groups: wp.array(dtype=Group),
    by_halves: int,
    first_node: int,  # of the first record's: from there on there are two nodes a record
    # Out:
    spilled: wp.array(dtype=Reference),  # room for the references of groups that are too large for the stack
    nodes: wp.array(dtype=Node),
    order_out: wp.array(dtype=wp.int32),
):
    """A thread builds the lower levels of the tree over one group of cells, whose leaves are blocks."""
    group = groups[first + wp.tid()]
    on_stack = wp.zeros(shape=GROUP, dtype=Reference)
    address = on_stack.ptr
    if group.record_count > GROUP:
        address = spilled.ptr + wp.uint64(REFERENCE_BYTES) * wp.uint64(group.first_spilled)
    references = wp.array(ptr=address, shape=(group.record_count,), dtype=Reference)
    gather_references(given, group, references)
    root = first_node + 2 * group.first_record
    split_all(references, group.record_count, LANES, 1, by_halves, nodes, root, group.first_record)
    for i in range(group.record_count):
        order_out[group.first_record + i] = wp.cast(references[i].low[3], wp.int32)
    nodes[group.node] = nodes[root]


def binary_tree(
    records: Records, count: int, box: np.ndarray, device: wp.Device, *, by_halves: bool
) -> tuple[wp.array, wp.array]:
    """Build a binary tree over ``count`` records.

    Args:
        box: (2, 3), about all records, unit space.
        by_halves: split in halves whatever the heuristic says: the tree is then no deeper than it must be.

    Returns:
        nodes: ``Node``, of which node 0 is the root.
        order: (count,) int32, the records in the order of the leaves.
    """
    grid = _grid_over(box, count)
    cell = wp.empty(count, dtype=wp.int32, device=device)
    launch.launch(number_cells, count, [records, grid, cell], device)
    start, ranks = bin_items(cell, cell_count(grid.size), device)
    given = SortedRecords()
    given.records, given.start, given.numbers = records, start, wp.empty_like(cell)
    launch.launch(sort_by_cell, count, [records, cell, start, ranks, given.numbers], device)
    del cell, ranks

    # The upper levels.
    starts = start.numpy()
    occupied = wp.array(np.flatnonzero(starts[1:] > starts[:-1]), dtype=wp.int32, device=device)
    given.cells = wp.empty(occupied.shape[0], dtype=Reference, device=device)
    launch.launch(measure_cells, occupied.shape[0], [records, given.numbers, occupied, start, given.cells], device)
    nodes = wp.empty(2 * occupied.shape[0] + 2 * count, dtype=Node, device=device)
    made = wp.empty(1, dtype=wp.int32, device=device)
    launch.launch(split_cells, 1, [given.cells, int(by_halves), nodes, made], device)

    # The lower ones of each group of cells.
    upper_nodes = int(made.numpy()[0])
    groups, spilled_count = _groups(nodes[:upper_nodes], given.cells)
    spilled = wp.empty(max(1, spilled_count), dtype=Reference, device=device)
    order = wp.empty(count, dtype=wp.int32, device=device)
    inputs = [given, wp.array(groups, dtype=Group, device=device), int(by_halves), upper_nodes]
    launch.launch(split_groups, len(groups), [*inputs, spilled, nodes, order], device)
    return nodes, order


def cell_count(size: Sequence[int]) -> int:
    """Cells of the finest grid, which has so many along each axis, and of all coarser ones."""
    total = math.prod(size)
    while max(size) > 1:
        size = [(n + 1) // 2 for n in size]
        total += math.prod(size)
    return total


def _grid_over(box: np.ndarray, count: int) -> Grid:
    """The grid over a box for so many records."""
    extent = np.maximum(box[1] - box[0], 0.0)
    along = min(max(round(CELLS_PER_ROOT * math.sqrt(count)), 1), MOST_CELLS)
    grid = Grid()
    grid.low = wp.vec3(*box[0])
    grid.cells_per_unit = float(along / max(float(extent.max()), SHORTEST))
    grid.size = wp.vec3i(*(max(1, math.ceil(side * grid.cells_per_unit)) for side in extent))
    return grid


def _groups(nodes: wp.array, cells: wp.array) -> tuple[np.ndarray, int]:
    """(n,) ``Group`` of each leaf of the upper levels, and how many references are too many for the stack."""
    made = nodes.numpy()
    counts = ~np.ascontiguousarray(made["high"][:, 3]).view(np.int32)
    leaves = np.flatnonzero(counts >= 0)
    first_cell, counts = np.ascontiguousarray(made["low"][leaves, 3]).view(np.int32), counts[leaves]
    records_before = np.concatenate([[0], np.cumsum(cells.numpy()["high"][:, 3], dtype=np.int64)])
    records = records_before[first_cell + counts] - records_before[first_cell]
    spilled = np.where(records > int(GROUP), records, 0)
    struct: Any = Group
    groups = np.zeros(len(leaves), struct.numpy_dtype())
    groups["node"], groups["first_cell"], groups["cell_count"] = leaves, first_cell, counts
    groups["first_record"], groups["record_count"] = np.cumsum(records) - records, records
    groups["first_spilled"] = np.cumsum(spilled) - spilled
    return groups, int(spilled.sum())
