"""What a tree (``tree.py``) that comes from a file must satisfy before a ray may go down it.

A walk reads the children of a node, the rows of a block, and the triangle that a record names, and asks none of them
whether it is there. So all of that is checked here: that every child is a later node or a block, that blocks follow
each other and fill the rows, that the children which a ray may have to come back to fit on its stack, and that every
record names a triangle of the mesh. A lane whose box is empty has no child. What is only a number, such as a corner, is
not checked: a wrong one is missed or met in a wrong place, and reads nothing.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.ldt.exact.tree import (
    LANES,
    NODE,
    PATCH_ROWS,
    PATCH_TRIANGLE_ROW,
    STACK,
    TRIANGLE_NUMBER_ROW,
    TRIANGLE_ROWS,
    TreeValues,
)

UNREACHED = 1.0e29
"""Sides of an empty box lie beyond this: a tenth of what a builder writes."""
LARGEST_NUMBER = 1.0e6
"""Of a length in unit space: far more than there is."""
SHORTEST_HORIZON = 1.0e-5
"""Unit space: by how much a search past a doubtful hit goes on at least. A patch of the finest maps is 0.0005 wide."""
MOST_RECORDS = 2**31
"""Records lie below this: their number is an int32."""


def check_tree(arrays: dict[str, np.ndarray], values: TreeValues, triangles: int) -> None:
    """Check what ``Tree.packed`` gave, for a mesh of so many triangles; the values may be of any type.

    Raises:
        ValueError, KeyError, TypeError: it is not sound; the message says what.
    """
    _check_values(values)
    for name in ("nodes", "rows"):
        _demand(arrays[name].dtype == np.float32 and arrays[name].ndim == 1, f"{name} of another type")
    numbers, rows = arrays["nodes"], arrays["rows"]
    _demand(numbers.size > 0 and numbers.size % int(NODE) == 0, "part of a node")
    _demand(rows.size % int(LANES) == 0, "part of a row")
    nodes, rows = numbers.reshape(-1, int(NODE)), rows.reshape(-1, int(LANES))
    children = np.ascontiguousarray(nodes[:, 6 * int(LANES) :]).view(np.int32)
    lows, highs = (nodes[:, : 6 * int(LANES)].reshape(-1, 3, 2, int(LANES))[:, :, side] for side in (0, 1))
    is_empty = (lows.min(axis=1) >= UNREACHED) & (highs.max(axis=1) <= -UNREACHED)
    _check_blocks(children[~is_empty], rows, triangles, bool(values["half_patch"] > 0.0))
    _check_depth(children, is_empty)


def _check_values(values: TreeValues) -> None:
    low, high = values["low"], values["high"]
    for name, corner in (("low", low), ("high", high)):
        _demand(len(corner) == 3 and all(_is_length(x) for x in corner), name)
    _demand(_is_length(values["front"]), "front")
    _demand(_is_length(values["half_patch"]), "half_patch")
    _demand(_is_length(values["horizon"]), "horizon")
    _demand(all(a <= b for a, b in zip(low, high, strict=True)), "a box inside out")
    _demand(values["front"] in (-1.0, 0.0, 1.0), "front")
    _demand(values["horizon"] >= (SHORTEST_HORIZON if values["front"] else 0.0), "horizon")
    _demand(values["half_patch"] >= 0.0, "half_patch")
    _demand(_is_whole(values["records"]) and 0 <= values["records"] < MOST_RECORDS, "records")


def _check_blocks(children: np.ndarray, rows: np.ndarray, triangles: int, may_be_patches: bool) -> None:
    """The blocks among the children that there are: they follow each other, and their records are of this mesh."""
    codes = np.sort(~children[children < 0])
    is_patch = (codes & 1) == 1
    _demand(may_be_patches or not is_patch.any(), "patches of no size")
    height = np.where(is_patch, int(PATCH_ROWS), int(TRIANGLE_ROWS))
    first = np.concatenate([[0], np.cumsum(height)])
    _demand(first[-1] == len(rows) and np.array_equal(codes >> 1, first[:-1]), "blocks that do not follow each other")
    for number, own in (
        (int(PATCH_TRIANGLE_ROW), first[:-1][is_patch]),
        (int(TRIANGLE_NUMBER_ROW), first[:-1][~is_patch]),
    ):
        triangle = np.take(rows, own + number, axis=0).view(np.int32)
        # Lanes that are not used are NaN in every row, and are never met.
        is_used = ~np.isnan(np.take(rows, own, axis=0))
        _demand(bool(((triangle >= 0) & (triangle < triangles) | ~is_used).all()), "a triangle that the mesh lacks")


def _check_depth(children: np.ndarray, is_empty: np.ndarray) -> None:
    """Every child node comes after its parent and is that of one alone; what waits on the way to it fits the stack."""
    count = len(children)
    is_node = (children >= 0) & ~is_empty
    parent, lane = np.nonzero(is_node)
    child = children[parent, lane]
    _demand(bool((child > parent).all() and (child < count).all()), "a child that does not come later")
    _demand(np.array_equal(np.sort(child), np.arange(1, count)), "a node that is not one other's child")
    parent_of = np.zeros(count, np.int64)
    parent_of[child] = parent
    # The sum of the children on the way from the root, by doubling: each round looks twice as far up.
    counts = (~is_empty).sum(axis=1)
    below_root, above = counts.copy(), parent_of
    below_root[0] = 0
    while above.any():
        below_root = below_root + below_root[above]
        above = above[above]
    _demand(int(below_root.max() + counts[0]) <= STACK, "more to come back to than there is room for")


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_length(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST_NUMBER


def _demand(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(f"wrong: {what}")
