"""The occupancy grid over a layered depth texture: where its surfaces are, and what lies there.

*Cell space* is texel space divided so that a cell is 1 wide; a *brick* is 4 x 4 x 4 cells. Three levels, each small
enough for its cache:

- ``leaps``: per octant of directions and brick, how many bricks a ray of that octant may leap; 0 in an occupied one.
- ``mask``: 64 bits per occupied brick, one per cell.
- *records*: what a cell holds, in blocks of 8 that are tested at once.

A record is a piece of a plane with two barycentric coordinates that are linear in the plane's points, 13 numbers in
the brick's own coordinates (Havel and Herout 2010). It is either a *triangle* of the mesh, exact, in every cell that
it touches; or a *patch*: a fragment's texel lifted to its plane, kept in the maps whose axis it faces. Triangles where
they are larger than texels, patches where many share a texel: the cost of a search stays, whatever the mesh.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

LANES = wp.constant(8)
"""Records in a block: the width of AVX2. 16 measured the same, 4 slower on dense meshes."""
ROWS = wp.constant(13)
"""Numbers in a record."""
BRICK = wp.constant(4)
"""Cells along a side of a brick."""
CELLS = wp.constant(64)
"""Cells in a brick: the bits of a mask."""

TRIANGLE = wp.constant(1.0)
SMALL_PATCH = wp.constant(2.0)
LARGE_PATCH = wp.constant(3.0)
"""Kinds of records, and the limit of the sum of their two coordinates. A small patch's triangle is smaller than the
patch, so any of its points will do for a hit's barycentrics; a large one's must be fetched."""


@wp.struct
class GridView:
    """An occupancy grid and its mesh."""

    leaps: wp.array(dtype=wp.uint8)  # octant * bricks + brick
    brick: wp.array(dtype=wp.int32)  # number among the occupied bricks, -1 if empty
    mask: wp.array(dtype=wp.uint64)  # per occupied brick
    block: wp.array(dtype=wp.int32)  # first block of each cell of each occupied brick; ends with the total
    rows: wp.array(dtype=wp.float32)  # block, row, lane
    triangle: wp.array(dtype=wp.int32)  # block, lane
    bricks: wp.vec3i  # along x, y, z
    low: wp.vec3  # the object's box, cell space
    high: wp.vec3
    front: float  # side of the records that can be seen from outside, 1 or -1 along their normals; 0 if not known
    cells_per_unit: float  # cell = cells_per_unit * unit + cell_offset
    cell_offset: wp.vec3
    vertices: wp.array(dtype=wp.vec3)  # unit space
    faces: wp.array(dtype=wp.vec3i)


@wp.func
def cell_number(x: float, cells: int) -> int:
    """The cell that holds a coordinate; the nearest if none does."""
    return wp.clamp(int(wp.floor(x)), 0, cells - 1)


@wp.func
def number_of_cell(bricks: wp.vec3i, x: int, y: int, z: int) -> int:
    """Number of a cell among all: brick by brick, 64 cells each."""
    brick = ((z / BRICK) * bricks[1] + y / BRICK) * bricks[0] + x / BRICK
    return CELLS * brick + ((z % BRICK) * BRICK + y % BRICK) * BRICK + x % BRICK


_DTYPES = {
    "leaps": wp.uint8,
    "brick": wp.int32,
    "mask": wp.uint64,
    "block": wp.int32,
    "rows": wp.float32,
    "triangle": wp.int32,
}
"""The arrays that are a grid's own."""


@dataclass(frozen=True, eq=False)
class Grid:
    """An occupancy grid on a device."""

    view: Any
    """The ``GridView``."""
    records: int
    """Triangles and patches in cells, as often as they lie in one."""
    patches: bool
    """Whether patches stand for triangles."""

    def packed(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """(arrays, values) that :meth:`unpacked` makes the same grid from, the mesh left out."""
        arrays = {name: getattr(self.view, name).numpy() for name in _DTYPES}
        values = {name: [float(x) for x in getattr(self.view, name)] for name in ("low", "high", "cell_offset")}
        values["bricks"] = [int(n) for n in self.view.bricks]
        plain = {name: float(getattr(self.view, name)) for name in ("front", "cells_per_unit")}
        return arrays, {**values, **plain, "records": int(self.records), "patches": bool(self.patches)}

    @classmethod
    def unpacked(
        cls, arrays: dict[str, np.ndarray], values: dict[str, Any], vertices: wp.array, faces: wp.array
    ) -> Grid:
        """The grid of a mesh on a device from what :meth:`packed` gave; on the CPU it shares the arrays' memory."""
        view = GridView()
        for name, dtype in _DTYPES.items():
            setattr(view, name, wp.array(arrays[name], dtype=dtype, device=vertices.device, copy=False))
        for name in ("low", "high", "cell_offset"):
            setattr(view, name, wp.vec3(*values[name]))
        view.bricks = wp.vec3i(*values["bricks"])
        view.front, view.cells_per_unit = values["front"], values["cells_per_unit"]
        view.vertices, view.faces = vertices, faces
        return cls(view, values["records"], values["patches"])

    @functools.cached_property
    def view_without_leaps(self) -> Any:
        """The ``GridView`` in which empty bricks are crossed one by one, to measure what the leaps save."""
        view = GridView()
        for name in vars(GridView)["vars"]:
            setattr(view, name, getattr(self.view, name))
        single = np.minimum(self.view.leaps.numpy(), 1)
        view.leaps = wp.array(single, dtype=wp.uint8, device=self.view.leaps.device)
        return view

    @property
    def nbytes(self) -> int:
        """Bytes that the grid takes, the mesh not counted."""
        arrays = (getattr(self.view, name) for name in _DTYPES)
        return sum(array.size * wp.types.type_size_in_bytes(array.dtype) for array in arrays)
