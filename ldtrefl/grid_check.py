"""What an occupancy grid (``grid.py``) that comes from a file must satisfy before a ray may walk through it.

A walk reads the nodes of a list, the rows of a node's blocks, and the triangle that a record names, and asks none of
them whether it is there. So all of that is checked here: the sizes of the arrays, that lists follow each other and have
as many nodes as blocks, that a node's unused boxes are empty, and every record's triangle and kind. What is only a
number, such as a plane, is not: a wrong one is missed or met in a wrong place, and reads nothing.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ldtrefl.grid import LANES, LARGE, PATCH_ROWS, SIDES, TRIANGLE_ROWS

DTYPES = {"leaps": np.uint8, "node": np.int32, "row": np.int32, "boxes": np.float32, "rows": np.float32}

UNREACHED = 1.0e29
"""Sides of an empty box lie beyond this: a tenth of what a builder writes."""
LARGEST_NUMBER = 1.0e6
"""Cells per unit, and any other length in cells: far more than a grid has."""
SHORTEST_HORIZON = 1.0e-4
"""Cells by which a search past a doubted hit goes on at least: a patch of the finest maps is 0.003 cells wide."""


def check_grid(arrays: dict[str, np.ndarray], values: dict[str, Any], triangles: int) -> None:
    """Check what ``Grid.packed`` gave, for a mesh of so many triangles.

    Raises:
        ValueError, KeyError, TypeError: it is not sound; the message says what.
    """
    _check_values(values)
    for name, dtype in DTYPES.items():
        _demand(arrays[name].dtype == dtype and arrays[name].ndim == 1, f"{name} of another type")
    node, row, cells = arrays["node"], arrays["row"], math.prod(values["cells"])
    _demand(arrays["leaps"].size == 8 * cells, "leaps for other cells")
    for name, array in (("node", node), ("row", row)):
        _demand(array.size == 2 * cells + 1 and array[0] == 0, f"{name} for other cells")
        _demand(bool((array[1:] >= array[:-1]).all()), f"{name} does not rise")
    _demand(arrays["boxes"].size == int(node[-1]) * int(SIDES * LANES), "boxes for other nodes")
    _demand(arrays["rows"].size == int(row[-1]) * int(LANES), "rows for other lists")

    # Only the lists that hold something, with their blocks.
    full = np.flatnonzero(row[1:] > row[:-1])
    _demand(np.array_equal(full, np.flatnonzero(node[1:] > node[:-1])), "rows without nodes")
    height = np.where(full % 2 == 0, int(PATCH_ROWS), int(TRIANGLE_ROWS)).astype(np.int32)
    rows, nodes = row[full + 1] - row[full], node[full + 1] - node[full]
    blocks = rows // height
    _demand(bool((blocks * height == rows).all()), "part of a block")
    _demand(bool((nodes == -(-blocks // int(LANES))).all()), "nodes for other blocks")
    _check_unused_boxes(arrays["boxes"], node[full + 1] - 1, blocks - int(LANES) * (nodes - 1))
    _check_records(arrays["rows"].reshape(-1, int(LANES)), row[full], blocks, height, triangles)


def _check_values(values: dict[str, Any]) -> None:
    cells = values["cells"]
    _demand(len(cells) == 3 and all(_is_whole(n) and n >= 1 for n in cells), "cells")
    _demand(math.prod(cells) < 2**27, "too many cells")
    for name in ("low", "high", "cell_offset"):
        _demand(len(values[name]) == 3 and all(_is_length(x) for x in values[name]), name)
    for name in ("front", "half_patch", "horizon", "cells_per_unit"):
        _demand(_is_length(values[name]), name)
    _demand(all(low <= high for low, high in zip(values["low"], values["high"], strict=True)), "a box inside out")
    _demand(values["cells_per_unit"] >= 1.0 / LARGEST_NUMBER, "cells_per_unit")
    _demand(values["front"] in (-1.0, 0.0, 1.0), "front")
    _demand(values["horizon"] >= (SHORTEST_HORIZON if values["front"] else 0.0), "horizon")
    _demand(values["half_patch"] >= 0.0, "half_patch")
    _demand(_is_whole(values["records"]) and 0 <= values["records"] < 2**31, "records")
    _demand(isinstance(values["patches"], bool), "patches")


def _check_unused_boxes(boxes: np.ndarray, last: np.ndarray, used: np.ndarray) -> None:
    """Of the last node of each list the boxes from ``used`` on must be empty: a ray into one would read beyond."""
    short = used < int(LANES)
    ends = np.take(boxes.reshape(-1, int(SIDES), int(LANES)), last[short], axis=0)
    unused = np.arange(int(LANES)) >= used[short, None]
    lows = np.minimum(np.minimum(ends[:, 0], ends[:, 2]), ends[:, 4])
    highs = np.maximum(np.maximum(ends[:, 1], ends[:, 3]), ends[:, 5])
    _demand(bool((~unused | ((lows >= UNREACHED) & (highs <= -UNREACHED))).all()), "a box about nothing")


def _check_records(rows: np.ndarray, first: np.ndarray, blocks: np.ndarray, height: np.ndarray, triangles: int) -> None:
    """The triangle of every record, and the kind of every patch, as they stand in the blocks of the lists."""
    for is_patch, number_row in ((True, 6), (False, 12)):
        own = (height == int(PATCH_ROWS)) == is_patch
        count = blocks[own]
        rank = np.arange(count.sum(), dtype=np.int32) - np.repeat(np.cumsum(count, dtype=np.int32) - count, count)
        block = np.repeat(first[own], count) + (PATCH_ROWS if is_patch else TRIANGLE_ROWS) * rank
        number = np.take(rows, block + number_row, axis=0).view(np.uint32)  # a negative one is large
        _demand(int(number.max(initial=0)) < triangles, "a triangle that the mesh does not have")
        if is_patch:
            kind = np.take(rows, block + 7, axis=0).view(np.uint32)
            _demand(bool(((kind & 3) < 3).all() and (kind < int(LARGE) + 3).all()), "a patch of no axis")


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_length(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST_NUMBER


def _demand(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(f"wrong: {what}")
