"""The occupancy grid over a layered depth texture: where its surfaces are, and what lies there.

*Cell space* is texel space divided so that a cell is 1 wide. A few dozen cells lie along an object's longest side, so
that the grid itself stays in the cache:

- ``leaps``: per octant of directions and cell, how many cells a ray of that octant may leap; 0 in an occupied one.
- *boxes*: what lies in an occupied cell, in blocks of 8 records; the boxes about 8 blocks make a node and are tested
  at once.
- *records*: the 8 of a block are tested at once.

A record lies in coordinates from the cell's corner. It is either a *triangle* of the mesh, exact, in every cell that it
touches: its plane and two barycentric coordinates that are linear in the plane's points (Havel and Herout 2010). Or it
is a *patch*: a fragment's texel lifted to its plane, kept in the maps whose axis it faces: the plane and the middle of
the texel, half as many numbers. Triangles where they are larger than texels, patches where many share a texel: the cost
of a search stays, whatever the mesh. A cell has two lists, first its patches, then its triangles.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl import warp_abi
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.strays import StrayTriangle

LANES = wp.constant(8)
"""Records in a block, and blocks in a node: the width of AVX2. 16 measured the same, 4 slower on dense meshes."""
TRIANGLE_ROWS = wp.constant(13)
"""Numbers of a triangle: its plane's n and n . p; two barycentric coordinates, linear in the point; its bits."""
PATCH_ROWS = wp.constant(8)
"""Numbers of a patch: its plane's n and n . p; the middle of its texel; the bits of its triangle and of its kind."""
SIDES = wp.constant(6)
"""Numbers in a box: low and high along x, y, z."""

TRIANGLE = wp.constant(-1)
"""Kind of a record that is a triangle; a patch's is the axis of its map, 0 to 2."""
LARGE = wp.constant(4)
"""Added to the kind of a patch whose triangle is larger than its texel: the barycentrics of a hit are then looked for,
while of a small triangle any of its points will do."""


@wp.struct
class GridView:
    """An occupancy grid and its mesh."""

    leaps: wp.array(dtype=wp.uint8)  # octant * cells + cell
    node: wp.array(dtype=wp.int32)  # first node of each list, two a cell; ends with the total
    row: wp.array(dtype=wp.int32)  # first row of each list's first block; ends with the total
    boxes: wp.array(dtype=wp.float32)  # node, side, lane
    rows: wp.array(dtype=wp.float32)  # row, lane; a block's rows follow each other
    cells: wp.vec3i  # along x, y, z
    low: wp.vec3  # the object's box, cell space
    high: wp.vec3
    front: float  # side of the records that can be seen from outside, 1 or -1 along their normals; 0 if not known
    half_patch: float  # half the side of a patch in its map, cells
    horizon: float  # how far past a doubted hit a search goes on, cells
    cells_per_unit: float  # cell = cells_per_unit * unit + cell_offset
    cell_offset: wp.vec3
    vertices: wp.array(dtype=wp.vec3)  # unit space
    faces: wp.array(dtype=wp.vec3i)
    strays: wp.array(dtype=StrayTriangle)  # what lies far outside, and in no cell


@wp.func
def cell_number(x: float, cells: int) -> int:
    """The cell that holds a coordinate; the nearest if none does."""
    return wp.clamp(int(wp.floor(x)), 0, cells - 1)


@wp.func
def number_of_cell(cells: wp.vec3i, x: int, y: int, z: int) -> int:
    """Number of a cell among all, row by row."""
    return (z * cells[1] + y) * cells[0] + x


_DTYPES = {
    "leaps": wp.uint8,
    "node": wp.int32,
    "row": wp.int32,
    "boxes": wp.float32,
    "rows": wp.float32,
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
        values["cells"] = [int(n) for n in self.view.cells]
        plain = {name: float(getattr(self.view, name)) for name in ("front", "half_patch", "horizon", "cells_per_unit")}
        return arrays, {**values, **plain, "records": int(self.records), "patches": bool(self.patches)}

    @classmethod
    def unpacked(cls, arrays: dict[str, np.ndarray], values: dict[str, Any], geometry: DeviceMesh) -> Grid:
        """The grid of a mesh on a device from what :meth:`packed` gave; on the CPU it shares the arrays' memory.

        What comes from a file is checked first (``grid_check.py``).
        """
        view = GridView()
        for name, dtype in _DTYPES.items():
            setattr(view, name, wp.array(arrays[name], dtype=dtype, device=geometry.vertices.device, copy=False))
        for name in ("low", "high", "cell_offset"):
            setattr(view, name, wp.vec3(*values[name]))
        view.cells = wp.vec3i(*values["cells"])
        for name in ("front", "half_patch", "horizon", "cells_per_unit"):
            setattr(view, name, values[name])
        view.vertices, view.faces, view.strays = geometry.vertices, geometry.faces, geometry.strays
        return cls(view, values["records"], values["patches"])

    @functools.cached_property
    def view_without_leaps(self) -> Any:
        """The ``GridView`` in which empty cells are crossed one by one, to measure what the leaps save."""
        view = warp_abi.copy_of_struct(self.view, GridView)
        single = np.minimum(self.view.leaps.numpy(), 1)
        view.leaps = wp.array(single, dtype=wp.uint8, device=self.view.leaps.device)
        return view

    @property
    def nbytes(self) -> int:
        """Bytes that the grid takes, the mesh not counted."""
        arrays = (getattr(self.view, name) for name in _DTYPES)
        return sum(warp_abi.array_bytes(array) for array in arrays)
