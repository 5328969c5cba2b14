"""The six orthographic face frames of a layered depth texture.

*Texel space* is an object's unit space scaled so that a texel is 1 wide along every axis; the map's box is
``0 <= p <= size``, ``size`` whole texels along x, y and z. The map of axis ``a`` looks along ``a``: its texel (u, v)
covers ``u <= p[a+1] < u+1`` and ``v <= p[a+2] < v+1`` (axes modulo 3), texel centres at +0.5, and its depth is
``p[a]``.

Faces 0..5 = +x, -x, +y, -y, +z, -z. Face ``2a`` looks from the box's high end of axis ``a`` down, face ``2a + 1`` from
its low end up. Both see the same surfaces in opposite order, so one sorted list per axis serves two faces.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import warp as wp

from ldtrefl.scene.mesh import Mesh

FACE_NAMES = ("+x", "-x", "+y", "-y", "+z", "-z")

SIDE_ROUNDING = 1e-4
"""Texels by which a side may be longer than whole texels and gain none: it may be a whole number but for rounding."""
CELL_ROUNDING = 1e-6
"""The same of cells that cover the box: its sides are whole texels, so their number is rounded once."""


@wp.func
def point_from_texel(axis: int, t: wp.vec3) -> wp.vec3:
    """The texel-space point at (u, v, depth) of the map of ``axis``."""
    return wp.vec3(t[(5 - axis) % 3], t[(3 - axis) % 3], t[(4 - axis) % 3])


@dataclasses.dataclass(frozen=True)
class TexelFrame:
    """The box of texels about a mesh: ``texel = scale * unit + offset``."""

    size: tuple[int, int, int]
    """Texels along x, y and z; the longest is the resolution."""
    scale: float
    offset: tuple[float, float, float]

    @classmethod
    def around(cls, unit_low: np.ndarray, unit_high: np.ndarray, resolution: int) -> TexelFrame:
        """The box of texels about a mesh, which lies in its middle.

        Args:
            unit_low: (3,) low corner of the mesh's box, unit space.
            unit_high: (3,) its high corner.
            resolution: texels along the longest side; along the others there are as few as cover them.
        """
        extent = unit_high.astype(float) - unit_low
        longest = float(extent.max())
        scale = resolution / longest if longest > 0.0 else float(resolution)
        x, y, z = (max(1, int(np.ceil(side * scale - SIDE_ROUNDING))) for side in extent)
        middle = unit_low + extent / 2.0
        ox, oy, oz = np.array([x, y, z]) / 2.0 - middle * scale
        return cls((x, y, z), scale, (float(ox), float(oy), float(oz)))

    def map_shape(self, axis: int) -> tuple[int, int]:
        """(rows, columns) = (texels along v, along u) of the map of ``axis``."""
        return self.size[(axis + 2) % 3], self.size[(axis + 1) % 3]

    def cells(self, along_longest: int) -> tuple[int, int, int]:
        """Cells along x, y and z that cover the box: cubes, ``along_longest`` of them along its longest side."""
        x, y, z = (max(1, int(np.ceil(side * along_longest / max(self.size) - CELL_ROUNDING))) for side in self.size)
        return x, y, z

    @property
    def first_texels(self) -> tuple[int, int, int, int]:
        """Number of the first texel of each axis' map when the three stand in one row, and the total."""
        counts = [rows * columns for rows, columns in map(self.map_shape, range(3))]
        return 0, counts[0], counts[0] + counts[1], sum(counts)


def texel_frame(mesh: Mesh, resolution: int) -> TexelFrame:
    """The box of texels about a mesh, ``resolution`` texels along its longest side."""
    centre, half = mesh.unit_frame
    low, high = ((bound - centre) / half for bound in mesh.bounds)
    return TexelFrame.around(low, high, resolution)
