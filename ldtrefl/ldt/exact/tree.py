"""The tree over an object's surfaces that the exact search goes down, eight boxes at a time.

*Records* are what a ray can meet. A record is a *triangle* of the mesh, by its three corners, or a *patch*: a
fragment's texel lifted to the plane of its triangle. A patch is made in the maps whose axis its plane faces, and is
stored as the plane and the middle of the texel. Triangles are searched where they are larger than texels, and patches
where many triangles share a texel: so the cost of a search does not grow with the mesh.

Up to eight records of one kind make a *block*. Each row of a block holds one number of each of the eight. Lanes that
are not used are NaN, which no ray meets.

A *node* holds the boxes about up to eight blocks or other nodes: per axis eight lows, then eight highs, then the
numbers of what lies in them, as ``rays.h`` reads them. Node 0 is the root; children have larger numbers.

Everything is in the object's unit space. Boxes are widened by the rounding of what a ray computes of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

import numpy as np
import warp as wp

from ldtrefl.device import warp_abi
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.outliers import Outliers

LANES = wp.constant(8)
"""Records in a block, and children of a node: the width of AVX2."""
TRIANGLE_ROWS = wp.constant(10)
"""Rows of a block of triangles: x, y and z of each of three corners; the bits of the triangle's number."""
PATCH_ROWS = wp.constant(8)
"""Rows of a block of patches: the plane's n and n . p; the middle of the texel in its map; the bits of the triangle's
number; the axis of the map, and ``LARGE_AXIS``."""
TRIANGLE_NUMBER_ROW = wp.constant(9)
"""Of a block of triangles: the row of their numbers."""
PATCH_TRIANGLE_ROW, PATCH_AXIS_ROW = wp.constant(6), wp.constant(7)
"""Of a block of patches: the rows of their triangles' numbers, and of their maps' axes."""
NODE = wp.constant(56)
"""Numbers of a node: six sides of eight boxes, and the bits of eight children."""
LARGE_AXIS = wp.constant(0.5)
"""Added to the axis of a patch whose triangle is larger than its texel: the barycentrics of a hit are then looked for.
In a small triangle any point will do."""
STACK = 256
"""Children that a ray has yet to come back to, at most."""

BOX_MARGIN = 4.0e-7
"""Unit space: by how much boxes are widened. Three roundings of coordinates up to 1, of the box's sides, of the ray's
start, and of a product."""

ALIGNMENT = 64
"""Bytes of a cache line."""

CACHED_BYTES = 12 << 20
"""Bytes of a tree up to which rays that do not stay together are searched for one by one. In turn they take as long on
a scan of 100,000 triangles (5.5 MB), a fifth longer on boxes of all sizes (11 MB), and two thirds as long in 25 MB."""


@wp.struct
class TreeView:
    """What kernels read of a tree and its mesh."""

    nodes: wp.array(dtype=wp.float32)
    rows: wp.array(dtype=wp.float32)
    low: wp.vec3  # the box about all records
    high: wp.vec3
    front: float  # side of the records that can be seen from outside, 1 or -1 along their normals; 0 if not known
    half_patch: float  # half the side of a patch in its map; 0 if there is none
    horizon: float  # how far past a doubtful hit a search goes on, unit space
    in_turn: int  # 1 for a tree larger than a cache: rays that do not stay together are searched for in turn
    vertices: wp.array(dtype=wp.vec3)
    faces: wp.array(dtype=wp.vec3i)
    outliers: Outliers  # triangles far outside the bulk of the mesh, which are not in the tree


class TreeValues(TypedDict):
    """What is kept of a tree beside its arrays."""

    low: list[float]
    high: list[float]
    front: float
    half_patch: float
    horizon: float
    records: int


_ARRAYS = ("nodes", "rows")


@dataclass(frozen=True, eq=False)
class Tree:
    """A tree on a device."""

    view: TreeView
    """What kernels read."""
    records: int
    """Triangles and patches."""

    @property
    def patches(self) -> bool:
        """Whether patches stand for triangles."""
        return bool(self.view.half_patch > 0.0)

    def packed(self) -> tuple[dict[str, np.ndarray], TreeValues]:
        """(arrays, values) that :meth:`unpacked` makes the same tree from, the mesh left out."""
        view = self.view
        values: TreeValues = {
            "low": [float(x) for x in view.low],
            "high": [float(x) for x in view.high],
            "front": float(view.front),
            "half_patch": float(view.half_patch),
            "horizon": float(view.horizon),
            "records": int(self.records),
        }
        return {"nodes": view.nodes.numpy(), "rows": view.rows.numpy()}, values

    @classmethod
    def unpacked(cls, arrays: dict[str, np.ndarray], values: TreeValues, geometry: DeviceMesh) -> Tree:
        """The tree of a mesh on a device from what :meth:`packed` gave.

        What comes from a file is checked first (``tree_check.py``).
        """
        device = geometry.vertices.device
        view = TreeView()
        view.nodes, view.rows = (aligned_empty(arrays[name].size, device) for name in _ARRAYS)
        for name in _ARRAYS:
            getattr(view, name).assign(arrays[name])
        view.low, view.high = wp.vec3(*values["low"]), wp.vec3(*values["high"])
        view.front, view.half_patch, view.horizon = values["front"], values["half_patch"], values["horizon"]
        return cls.of(view, values["records"], geometry)

    @classmethod
    def of(cls, view: TreeView, records: int, geometry: DeviceMesh) -> Tree:
        """The tree of a view that lacks its mesh."""
        view.vertices, view.faces, view.outliers = geometry.vertices, geometry.faces, geometry.outliers
        made = cls(view, records)
        view.in_turn = int(made.nbytes > CACHED_BYTES)
        return made

    @property
    def nbytes(self) -> int:
        """Bytes that the tree takes, the mesh not counted."""
        return sum(warp_abi.array_bytes(getattr(self.view, name)) for name in _ARRAYS)


def aligned_empty(count: int, device: wp.Device) -> wp.array:
    """(count,) float32 that begins with a cache line, so that no eight of them lie in two."""
    spare = ALIGNMENT // 4
    room = wp.empty(count + spare, dtype=wp.float32, device=device)
    first = -room.ptr % ALIGNMENT // 4
    return room[first : first + count]
