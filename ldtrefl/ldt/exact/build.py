"""Records -> tree (``tree.py``), on all cores.

items -> cells -> parts of the cells by the surface area heuristic, on one thread -> parts of the items of each, on all
-> eight parts a node -> blocks and nodes

Items are first sorted into a grid, so that the upper levels of the tree, which one thread builds, are found from a few
thousand cells. The lower levels of each group of cells are then built beside the others'.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.base.budget import memory_limit
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.bins import bin_items
from ldtrefl.device.native_sources import native_body
from ldtrefl.ldt.exact.pieces import LARGE, Piece, cell_number, high_corner, low_corner, number_of_cell
from ldtrefl.ldt.exact.tree import (
    BOX_MARGIN,
    LANES,
    LARGE_AXIS,
    NODE,
    PATCH_ROWS,
    STACK,
    TRIANGLE_ROWS,
    Tree,
    TreeView,
    aligned_empty,
)
from ldtrefl.world.device_mesh import DeviceMesh

CELLS_PER_ROOT = 0.13
"""Cells along the longest side per square root of the items, so that some twenty lie in an occupied one. From 0.08 to
0.2 trees are as fast, within 3%, and building takes as long."""
MOST_CELLS = 128
GROUP = wp.constant(512)
"""Items of a group of cells, but where one cell holds more: some fit in a core's first cache."""
REFERENCE_BYTES = wp.constant(32)
"""Of a ``Reference``."""
BYTES_PER_RECORD = 80
"""What a record takes, and what it is made from, at most."""
MOST_RECORDS = 100_000_000
"""Records of a tree: the numbers of rows fit in an int32 with their kind."""
EMPTY = 1.0e30
"""Sides of a box with nothing in it: its low is above its high."""
SHORTEST = 1.0e-30
"""Length that no box that is split is shorter than."""


@wp.struct
class Items:
    """What records are made from. Items from 0 on are triangles, below 0 patches: -1 is patch 0."""

    numbers: wp.array(dtype=wp.int32)  # empty: all triangles
    vertices: wp.array(dtype=wp.vec3)  # unit space
    faces: wp.array(dtype=wp.vec3i)
    patches: wp.array(dtype=Piece)
    unit_per_cell: float  # of the cells that patches are given in
    unit_offset: wp.vec3


@wp.struct
class Reference:
    """A box to be put into the tree, as ``tree_build.h`` has it."""

    low: wp.vec4  # and the bits of its number
    high: wp.vec4  # and how many items lie in it


@wp.struct
class Node:
    """A node of a binary tree, as ``tree_build.h`` has it."""

    low: wp.vec4  # and the bits of the number of a part, or of a leaf's first reference
    high: wp.vec4  # and those of the other part's, or of a leaf's ~count


@wp.struct
class Cells:
    """The grid that items are sorted into, by their middles; those larger than a cell into one of cells twice as wide,
    and so on, so that items of a cell are of a size."""

    low: wp.vec3
    per_unit: float
    size: wp.vec3i  # of the finest


@wp.func
def item_number(items: Items, i: int) -> int:
    """The ``i``-th item."""
    if items.numbers.shape[0] > 0:
        return items.numbers[i]
    return i


@wp.func
def unit_piece(items: Items, item: int) -> Piece:
    """A patch in unit space."""
    piece = items.patches[-1 - item]
    piece.corner = items.unit_per_cell * piece.corner + items.unit_offset
    piece.edge_u = items.unit_per_cell * piece.edge_u
    piece.edge_v = items.unit_per_cell * piece.edge_v
    return piece


@wp.func
def reference_to(items: Items, item: int) -> Reference:
    """The box about an item."""
    low, high = wp.vec3(0.0), wp.vec3(0.0)
    if item >= 0:
        corners = items.faces[item]
        a, b, c = items.vertices[corners[0]], items.vertices[corners[1]], items.vertices[corners[2]]
        low, high = wp.min(a, wp.min(b, c)), wp.max(a, wp.max(b, c))
    else:
        piece = unit_piece(items, item)
        low, high = low_corner(piece), high_corner(piece)
    made = Reference()
    made.low = wp.vec4(low[0], low[1], low[2], wp.cast(item, wp.float32))
    made.high = wp.vec4(high[0], high[1], high[2], 1.0)
    return made


@launch.kernel
def number_cells(
    first: int,
    # In:
    items: Items,
    cells: Cells,
    # Out:
    cell_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    box = reference_to(items, item_number(items, i))
    per_unit, size = float(cells.per_unit), wp.vec3i(cells.size)
    extent = per_unit * wp.max(box.high[0] - box.low[0], wp.max(box.high[1] - box.low[1], box.high[2] - box.low[2]))
    before = int(0)  # cells of finer grids
    while extent > 1.0 and wp.max(size) > 1:
        before += size[0] * size[1] * size[2]
        size = wp.vec3i((size[0] + 1) / 2, (size[1] + 1) / 2, (size[2] + 1) / 2)
        per_unit *= 0.5
        extent *= 0.5
    x = cell_number(per_unit * (0.5 * (box.low[0] + box.high[0]) - cells.low[0]), size[0])
    y = cell_number(per_unit * (0.5 * (box.low[1] + box.high[1]) - cells.low[1]), size[1])
    z = cell_number(per_unit * (0.5 * (box.low[2] + box.high[2]) - cells.low[2]), size[2])
    cell_out[i] = before + number_of_cell(size, x, y, z)


def cell_count(size: Sequence[int]) -> int:
    """Cells of the finest grid, which has so many along each axis, and of all coarser ones."""
    total = math.prod(size)
    while max(size) > 1:
        size = [(n + 1) // 2 for n in size]
        total += math.prod(size)
    return total


@launch.kernel
def put_in_order(
    first: int,
    # In:
    items: Items,
    cell: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    # Out:
    item_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    item_out[start[cell[i]] + ranks[i]] = item_number(items, i)


@launch.kernel
def measure_cells(
    first: int,
    # In:
    items: Items,
    item: wp.array(dtype=wp.int32),  # in the order of their cells
    occupied: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    # Out:
    reference_out: wp.array(dtype=Reference),
):
    i = first + wp.tid()
    begin, end = start[occupied[i]], start[occupied[i] + 1]
    made = reference_to(items, item[begin])
    for k in range(begin + 1, end):
        one = reference_to(items, item[k])
        made.low = wp.min(made.low, one.low)
        made.high = wp.max(made.high, one.high)
    made.low[3] = wp.cast(occupied[i], wp.float32)
    made.high[3] = float(end - begin)
    reference_out[i] = made


CONSTANTS = {"EMPTY": EMPTY, "SHORTEST": SHORTEST, "TREE_STACK": STACK}
FILES = ("device/vectors.h", "ldt/exact/build.h")
"""What native functions here are made of."""


SPLIT = """
    return TreeBuild::split_all(
        (TreeBuild::Reference*)references.data, count, most, are_items != 0, by_halves != 0,
        (TreeBuild::Node*)nodes.data + root, root + 1, first
    );
"""


@wp.func_native(native_body(CONSTANTS, FILES, SPLIT))
def split_all(
    references: wp.array(dtype=Reference),
    count: int,
    most: int,
    are_items: int,
    by_halves: int,
    nodes: wp.array(dtype=Node),
    root: int,
    first: int,
) -> wp.int32:
    """Split ``count`` references until at most ``most`` items are left together, and number them from
    ``first``; nodes go to ``root`` and after it. Their number."""
    ...


@launch.kernel
def split_cells(
    first: int,
    # In and out:
    references: wp.array(dtype=Reference),
    # In:
    by_halves: int,
    # Out:
    nodes_out: wp.array(dtype=Node),
    count_out: wp.array(dtype=wp.int32),
):
    count_out[0] = split_all(references, references.shape[0], GROUP, 0, by_halves, nodes_out, 0, 0)


@wp.struct
class SortedItems:
    """Items in the order of their cells."""

    items: Items
    item: wp.array(dtype=wp.int32)
    start: wp.array(dtype=wp.int32)  # first of each cell
    cells: wp.array(dtype=Reference)  # those that are occupied, in the order of the upper levels' leaves


@wp.struct
class Group:
    """A leaf of the upper levels: some cells, and the room for what is made of their items."""

    node: int
    first_cell: int
    cell_count: int
    first_item: int  # in the order of the leaves
    item_count: int
    room: int  # first reference, where they are too many for the stack


@wp.func
def gather_items(sorted_items: SortedItems, group: Group, references_out: wp.array(dtype=Reference)):
    """References to the items of a group."""
    at = int(0)
    for k in range(group.first_cell, group.first_cell + group.cell_count):
        cell = wp.cast(sorted_items.cells[k].low[3], wp.int32)
        for i in range(sorted_items.start[cell], sorted_items.start[cell + 1]):
            references_out[at] = reference_to(sorted_items.items, sorted_items.item[i])
            at += 1


@launch.kernel
def split_groups(
    first: int,
    # In:
    sorted_items: SortedItems,
    groups: wp.array(dtype=Group),
    by_halves: int,
    first_node: int,  # of the first item's: from there on there are two nodes an item
    # Out:
    room: wp.array(dtype=Reference),
    nodes: wp.array(dtype=Node),
    item_out: wp.array(dtype=wp.int32),
):
    group = groups[first + wp.tid()]
    own_room = wp.zeros(shape=GROUP, dtype=Reference)
    address = own_room.ptr
    if group.item_count > GROUP:
        address = room.ptr + wp.uint64(REFERENCE_BYTES) * wp.uint64(group.room)
    references = wp.array(ptr=address, shape=(group.item_count,), dtype=Reference)
    gather_items(sorted_items, group, references)
    root = first_node + 2 * group.first_item
    split_all(references, group.item_count, LANES, 1, by_halves, nodes, root, group.first_item)
    for i in range(group.item_count):
        item_out[group.first_item + i] = wp.cast(references[i].low[3], wp.int32)
    nodes[group.node] = nodes[root]


GATHER = """
    TreeBuild::Wide wide = {parts.data, children.data, waiting.data};
    TreeBuild::gather_all((const TreeBuild::Node*)nodes.data, item.data, patch_rows, triangle_rows, wide);
    counts.data[0] = wide.nodes;
    counts.data[1] = wide.rows;
    counts.data[2] = wide.most_waiting;
"""


@wp.func_native(native_body(CONSTANTS, FILES, GATHER))
def gather_all(
    nodes: wp.array(dtype=Node),
    item: wp.array(dtype=wp.int32),
    patch_rows: int,
    triangle_rows: int,
    parts: wp.array(dtype=wp.int32),
    children: wp.array(dtype=wp.int32),
    waiting: wp.array(dtype=wp.int32),
    counts: wp.array(dtype=wp.int32),
):
    """Gather the nodes of the binary tree into those of the wide one, a part before the next."""
    ...


@launch.kernel
def gather_nodes(
    first: int,
    # In:
    nodes: wp.array(dtype=Node),
    item: wp.array(dtype=wp.int32),
    # Out: per wide node the binary nodes of its parts, or -1; its children; what a ray may leave waiting
    parts_out: wp.array(dtype=wp.int32),
    children_out: wp.array(dtype=wp.int32),
    waiting_out: wp.array(dtype=wp.int32),
    counts_out: wp.array(dtype=wp.int32),  # wide nodes, rows, the most that waits
):
    gather_all(nodes, item, PATCH_ROWS, TRIANGLE_ROWS, parts_out, children_out, waiting_out, counts_out)


@wp.func
def write_patch(items: Items, item: int, at: int, rows: wp.array(dtype=float)):
    """Write a patch into the lane of a block that begins at ``at``."""
    piece = unit_piece(items, item)
    middle = piece.corner + 0.5 * (piece.edge_u + piece.edge_v)
    normal = wp.normalize(wp.cross(piece.edge_u, piece.edge_v))
    axis = piece.kind % LARGE
    for k in range(3):
        rows[at + k * LANES] = normal[k]
    rows[at + 3 * LANES] = wp.dot(normal, middle)
    rows[at + 4 * LANES] = middle[(axis + 1) % 3]
    rows[at + 5 * LANES] = middle[(axis + 2) % 3]
    rows[at + 6 * LANES] = wp.cast(piece.triangle, wp.float32)
    rows[at + 7 * LANES] = float(axis) + wp.where(piece.kind >= LARGE, LARGE_AXIS, 0.0)


@wp.func
def write_triangle(items: Items, item: int, at: int, rows: wp.array(dtype=float)):
    """Write a triangle into the lane of a block that begins at ``at``."""
    corners = items.faces[item]
    for corner in range(3):
        point = items.vertices[corners[corner]]
        for k in range(3):
            rows[at + (3 * corner + k) * LANES] = point[k]
    rows[at + 9 * LANES] = wp.cast(item, wp.float32)


@launch.kernel
def write_nodes(
    first: int,
    # In:
    items: Items,
    nodes: wp.array(dtype=Node),
    item: wp.array(dtype=wp.int32),
    parts: wp.array(dtype=wp.int32),
    children: wp.array(dtype=wp.int32),
    # Out:
    nodes_out: wp.array(dtype=wp.float32),
    rows_out: wp.array(dtype=wp.float32),
):
    i = first + wp.tid()
    place = NODE * i
    for lane in range(LANES):
        part = parts[LANES * i + lane]
        low, high = wp.vec4(EMPTY), wp.vec4(-EMPTY)
        if part >= 0:
            low, high = nodes[part].low - wp.vec4(BOX_MARGIN), nodes[part].high + wp.vec4(BOX_MARGIN)
        for k in range(3):
            nodes_out[place + 2 * k * LANES + lane] = low[k]
            nodes_out[place + (2 * k + 1) * LANES + lane] = high[k]
        child = children[LANES * i + lane]
        nodes_out[place + 6 * LANES + lane] = wp.cast(child, wp.float32)
        if child < 0:
            begin = wp.cast(nodes[part].low[3], wp.int32)
            count = ~wp.cast(nodes[part].high[3], wp.int32)
            at = LANES * (~child >> 1)
            is_patch = (~child & 1) == 1
            for k in range(count):
                if is_patch:
                    write_patch(items, item[begin + k], at + k, rows_out)
                else:
                    write_triangle(items, item[begin + k], at + k, rows_out)
            for row in range(wp.where(is_patch, PATCH_ROWS, TRIANGLE_ROWS)):
                for k in range(count, LANES):
                    rows_out[at + row * LANES + k] = wp.nan


def build_tree(items: Any, count: int, box: np.ndarray, geometry: DeviceMesh) -> Tree:
    """The tree of ``count`` ``Items`` of a mesh; ``box`` is (2, 3), about all, in unit space.

    Raises:
        InputError: they need more memory than is allowed.
    """
    if count > min(MOST_RECORDS, memory_limit() // BYTES_PER_RECORD):
        raise InputError(
            f"the mesh has {len(geometry.faces)} triangles, too many to search (--memory allows {memory_limit()} bytes)"
        )
    nodes, order = _binary_tree(items, count, box, geometry.vertices.device, by_halves=False)
    made = _wide_tree(items, nodes, order, geometry)
    if made is None:
        # Boxes within boxes, hundreds deep: splitting in halves cannot go so deep.
        nodes, order = _binary_tree(items, count, box, geometry.vertices.device, by_halves=True)
        made = _wide_tree(items, nodes, order, geometry)
        assert made is not None
    return Tree.of(made, count, geometry)


def _binary_tree(
    items: Any, count: int, box: np.ndarray, device: wp.Device, *, by_halves: bool
) -> tuple[wp.array, wp.array]:
    """The nodes of a binary tree, and the items in the order of its leaves."""
    cells = _cells_about(box, count)
    cell = wp.empty(count, dtype=wp.int32, device=device)
    launch.launch(number_cells, count, [items, cells, cell], device)
    start, ranks = bin_items(cell, cell_count(cells.size), device)
    item = wp.empty_like(cell)
    launch.launch(put_in_order, count, [items, cell, start, ranks, item], device)
    del cell, ranks

    # The upper levels.
    starts = start.numpy()
    occupied = wp.array(np.flatnonzero(starts[1:] > starts[:-1]), dtype=wp.int32, device=device)
    references = wp.empty(occupied.shape[0], dtype=Reference, device=device)
    launch.launch(measure_cells, occupied.shape[0], [items, item, occupied, start, references], device)
    nodes = wp.empty(2 * occupied.shape[0] + 2 * count, dtype=Node, device=device)
    made = wp.empty(1, dtype=wp.int32, device=device)
    launch.launch(split_cells, 1, [references, int(by_halves), nodes, made], device)

    # The lower ones of each group of cells.
    upper_nodes = int(made.numpy()[0])
    groups, in_room = _groups(nodes[:upper_nodes], references)
    sorted_items = SortedItems()
    sorted_items.items, sorted_items.item, sorted_items.start, sorted_items.cells = items, item, start, references
    room, order = wp.empty(max(1, in_room), dtype=Reference, device=device), wp.empty_like(item)
    inputs = [sorted_items, wp.array(groups, dtype=Group, device=device), int(by_halves), upper_nodes]
    launch.launch(split_groups, len(groups), [*inputs, room, nodes, order], device)
    return nodes, order


def _cells_about(box: np.ndarray, count: int) -> Any:
    """The grid over a box for so many items."""
    extent = np.maximum(box[1] - box[0], 0.0)
    along = min(max(round(CELLS_PER_ROOT * math.sqrt(count)), 1), MOST_CELLS)
    cells = Cells()
    cells.low = wp.vec3(*box[0])
    cells.per_unit = float(along / max(float(extent.max()), SHORTEST))
    cells.size = wp.vec3i(*(max(1, math.ceil(side * cells.per_unit)) for side in extent))
    return cells


def _groups(nodes: wp.array, references: wp.array) -> tuple[np.ndarray, int]:
    """(n,) ``Group`` of each leaf of the upper levels, and how many references have to lie in the room beside."""
    made = nodes.numpy()
    cells = ~np.ascontiguousarray(made["high"][:, 3]).view(np.int32)
    leaves = np.flatnonzero(cells >= 0)
    first_cell, cells = np.ascontiguousarray(made["low"][leaves, 3]).view(np.int32), cells[leaves]
    items_before = np.concatenate([[0], np.cumsum(references.numpy()["high"][:, 3], dtype=np.int64)])
    items = items_before[first_cell + cells] - items_before[first_cell]
    in_room = np.where(items > int(GROUP), items, 0)
    struct: Any = Group
    groups = np.zeros(len(leaves), struct.numpy_dtype())
    groups["node"], groups["first_cell"], groups["cell_count"] = leaves, first_cell, cells
    groups["first_item"], groups["item_count"] = np.cumsum(items) - items, items
    groups["room"] = np.cumsum(in_room) - in_room
    return groups, int(in_room.sum())


def _wide_tree(items: Any, nodes: wp.array, order: wp.array, geometry: DeviceMesh) -> Any:
    """The ``TreeView`` of a binary tree; None if a ray might have more to come back to than it can hold."""
    device, count = geometry.vertices.device, order.shape[0]
    parts, children = (wp.empty(int(LANES) * count, dtype=wp.int32, device=device) for _ in range(2))
    waiting, counts = wp.empty(count, dtype=wp.int32, device=device), wp.empty(3, dtype=wp.int32, device=device)
    launch.launch(gather_nodes, 1, [nodes, order, parts, children, waiting, counts], device)
    node_count, row_count, most_waiting = (int(n) for n in counts.numpy())
    if most_waiting > STACK:
        return None
    view = TreeView()
    view.nodes = aligned_empty(node_count * int(NODE), device)
    view.rows = aligned_empty(row_count * int(LANES), device)
    inputs = [items, nodes, order, parts, children]
    launch.launch(write_nodes, node_count, [*inputs, view.nodes, view.rows], device)
    root = nodes[:1].numpy()
    margin = np.float32(BOX_MARGIN)
    view.low = wp.vec3(*(root["low"][0, :3] - margin))
    view.high = wp.vec3(*(root["high"][0, :3] + margin))
    return view
