"""Binary tree -> the tree that rays go down (``tree.py``): eight parts a node, and blocks of eight records.

Which parts become the children of a node is found in C++ (``wide_tree.h``), on one thread. Nodes and blocks are then
written on all.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.native_sources import native_body
from ldtrefl.ldt.exact import binary_tree
from ldtrefl.ldt.exact.binary_tree import EMPTY, Node
from ldtrefl.ldt.exact.records import Records, fetch_ahead, write_patch, write_triangle
from ldtrefl.ldt.exact.tree import (
    BOX_MARGIN,
    LANES,
    NODE,
    PATCH_ROWS,
    STACK,
    TRIANGLE_ROWS,
    TreeView,
    aligned_empty,
)

CONSTANTS = {**binary_tree.CONSTANTS, "TREE_STACK": STACK}
"""What the C++ reads, by the names that it has there."""
FILES = (*binary_tree.FILES, "ldt/exact/wide_tree.h")
"""The C++ of the gathering, each file after those that its class is derived from."""

GATHER = """
    WideTree::Wide wide = {parts.data, children.data, waiting.data};
    WideTree::gather((const WideTree::Node*)nodes.data, order.data, patch_rows, triangle_rows, wide);
    counts.data[0] = wide.nodes;
    counts.data[1] = wide.rows;
    counts.data[2] = wide.most_waiting;
"""


@wp.func_native(native_body(CONSTANTS, FILES, GATHER))
def gather(
    nodes: wp.array(dtype=Node),
    order: wp.array(dtype=wp.int32),
    patch_rows: int,
    triangle_rows: int,
    parts: wp.array(dtype=wp.int32),
    children: wp.array(dtype=wp.int32),
    waiting: wp.array(dtype=wp.int32),
    counts: wp.array(dtype=wp.int32),
):
    """Gather the nodes of a binary tree into those of the wide one, a part before the next."""
    ...


@launch.kernel
def gather_nodes(
    first: int,
    # In:
    nodes: wp.array(dtype=Node),
    order: wp.array(dtype=wp.int32),  # records in the order of the leaves
    # Out, per wide node: the binary nodes of its parts, or -1; its children; the most that a ray may leave waiting
    parts_out: wp.array(dtype=wp.int32),
    children_out: wp.array(dtype=wp.int32),
    waiting_out: wp.array(dtype=wp.int32),
    # Out: wide nodes, rows, the most that waits
    counts_out: wp.array(dtype=wp.int32),
):
    """The only thread finds the parts of all wide nodes, and numbers their children."""
    gather(nodes, order, PATCH_ROWS, TRIANGLE_ROWS, parts_out, children_out, waiting_out, counts_out)


@wp.func
def write_block(records: Records, node: Node, child: int, order: wp.array(dtype=wp.int32), rows: wp.array(dtype=float)):
    """Write the records of a leaf into the block that ``child`` names; lanes that are left over are NaN."""
    begin = wp.cast(node.low[3], wp.int32)
    count = ~wp.cast(node.high[3], wp.int32)
    at = LANES * (~child >> 1)
    is_patch = (~child & 1) == 1
    for k in range(count):
        fetch_ahead(records, order, begin + k)
        if is_patch:
            write_patch(records, order[begin + k], at + k, rows)
        else:
            write_triangle(records, order[begin + k], at + k, rows)
    for row in range(wp.where(is_patch, PATCH_ROWS, TRIANGLE_ROWS)):
        for k in range(count, LANES):
            rows[at + row * LANES + k] = wp.nan


@launch.kernel
def write_nodes(
    first: int,
    # In:
    records: Records,
    nodes: wp.array(dtype=Node),
    order: wp.array(dtype=wp.int32),
    parts: wp.array(dtype=wp.int32),
    children: wp.array(dtype=wp.int32),
    # Out:
    nodes_out: wp.array(dtype=wp.float32),
    rows_out: wp.array(dtype=wp.float32),
):
    """A thread writes one wide node, and the blocks among its children."""
    i = first + wp.tid()
    place = NODE * i
    lanes = int(LANES)  # a variable: Warp would write the loop out, and its compiler take twice as long
    for lane in range(lanes):
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
            write_block(records, nodes[part], child, order, rows_out)


def wide_tree(records: Records, nodes: wp.array, order: wp.array) -> TreeView | None:
    """The tree that rays go down, its mesh left out, from a binary tree over records.

    Returns None if a ray might have to come back to more children than it can hold.

    Args:
        nodes: ``Node`` of the binary tree, the root first.
        order: (records,) int32, the records in the order of its leaves.
    """
    device, count = order.device, order.shape[0]
    parts, children = (wp.empty(int(LANES) * count, dtype=wp.int32, device=device) for _ in range(2))
    waiting, counts = wp.empty(count, dtype=wp.int32, device=device), wp.empty(3, dtype=wp.int32, device=device)
    launch.launch(gather_nodes, 1, [nodes, order, parts, children, waiting, counts], device)
    node_count, row_count, most_waiting = (int(n) for n in counts.numpy())
    if most_waiting > STACK:
        return None
    view = TreeView()
    view.nodes = aligned_empty(node_count * int(NODE), device)
    view.rows = aligned_empty(row_count * int(LANES), device)
    inputs = [records, nodes, order, parts, children]
    launch.launch(write_nodes, node_count, [*inputs, view.nodes, view.rows], device)
    root = nodes[:1].numpy()
    margin = np.float32(BOX_MARGIN)
    view.low = wp.vec3(*(root["low"][0, :3] - margin))
    view.high = wp.vec3(*(root["high"][0, :3] + margin))
    return view
