"""The sorted maps of a layered depth texture as they lie in memory, what kernels read of them, and their checks.

Three maps, one per axis, stand in one row of texels. Texel ``i`` holds fragments ``start[i]`` to ``start[i + 1]``,
sorted by depth along the axis; two fragments of one depth are sorted by triangle. A fragment is a depth (float32,
texels) and a reference (int32): its triangle's number times 2, plus 1 if the triangle faces up the axis. Normal, UVs
and colour are those of the triangle, at the mesh's resolution. Memory follows the fragments: 8 bytes each, and 4 for
every texel; what ``linear/occupancy.py`` derives from them takes another byte a fragment, and little else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.ldt.fragments import Fragments
from ldtrefl.ldt.linear.occupancy import Occupancy, occupancy_of
from ldtrefl.ldt.texel_frame import TexelFrame
from ldtrefl.ldt.texel_sort import sort_into_texels, sort_texels
from ldtrefl.world.device_mesh import DeviceMesh

ONE_A_TEXEL = 0
"""In place of a number of ``linear_steps``: one sample for each texel that the ray passes."""


@wp.struct
class MapsView:
    """Sorted maps, their mesh, and how the linear search goes through them."""

    start: wp.array(dtype=wp.int32)
    depth: wp.array(dtype=wp.float32)
    reference: wp.array(dtype=wp.int32)
    inside: wp.array(dtype=wp.uint8)  # per fragment, behind it: INSIDE_UP, INSIDE_DOWN (occupancy.py)
    cells: wp.array(dtype=wp.uint64)  # columns of the occupancy, coarser and coarser
    words_per_octant: int  # 0 where one occupancy serves all octants
    cell_shift: int  # a cell is 2 to this power texels wide
    column_shift: int  # the finest columns stand in a square that is 2 to this power wide
    levels: int  # of columns, at most 3
    first_column: wp.vec3i  # of each level
    size: wp.vec3i  # texels along x, y, z
    first_texel: wp.vec3i  # of each axis' map
    texels_per_unit: float  # texel = texels_per_unit * unit + texel_offset
    texel_offset: wp.vec3
    vertices: wp.array(dtype=wp.vec3)  # unit space
    faces: wp.array(dtype=wp.vec3i)
    linear_steps: int  # samples on a ray's way through the box, or ONE_A_TEXEL
    binary_steps: int


@wp.func
def triangle_of(reference: int) -> int:
    """A fragment's triangle."""
    return reference >> 1


@dataclass(frozen=True, eq=False)
class Maps:
    """The fragments in their texels, each texel sorted."""

    start: wp.array
    """(texels + 1,) int32, the first fragment of each texel."""
    depth: wp.array
    """(fragments,) float32."""
    reference: wp.array
    """(fragments,) int32."""
    occupancy: Occupancy
    """Derived from the others."""

    @classmethod
    def of(cls, frame: TexelFrame, fragments: Fragments) -> Maps:
        """Maps of a box of texels from its fragments, in any order."""
        start, depth, reference = sort_into_texels(fragments, frame.first_texels[3])
        return cls(start, depth, reference, occupancy_of(frame, start, depth, reference))

    @classmethod
    def from_arrays(cls, frame: TexelFrame, arrays: dict[str, np.ndarray], device: wp.Device) -> Maps:
        """Maps from copies of "start", "depth" and "reference", whose texels need not be sorted.

        What comes from a file is checked first: :func:`check_fragments`.
        """
        start, depth, reference = _on_device(arrays, device, copy=True)
        sort_texels(start, depth, reference)
        return cls(start, depth, reference, occupancy_of(frame, start, depth, reference))

    def packed(self) -> tuple[dict[str, np.ndarray], dict[str, object]]:
        """(arrays, nothing else) that :meth:`unpacked` makes the same maps from."""
        return {name: getattr(self, name).numpy() for name in _DTYPES}, {}

    @classmethod
    def unpacked(cls, frame: TexelFrame, arrays: dict[str, np.ndarray], device: wp.Device) -> Maps:
        """Maps from what :meth:`packed` gave; on the CPU they share the arrays' memory.

        What comes from a file is checked first: :func:`check_fragments`, :func:`check_order`.
        """
        start, depth, reference = _on_device(arrays, device, copy=False)
        return cls(start, depth, reference, occupancy_of(frame, start, depth, reference))

    @property
    def nbytes(self) -> int:
        """Bytes of the maps and what is derived from them."""
        return 4 * (self.start.size + self.depth.size + self.reference.size) + self.occupancy.nbytes

    def view(self, frame: TexelFrame, geometry: DeviceMesh, linear_steps: int, binary_steps: int) -> MapsView:
        """What the linear search reads; ``linear_steps`` may be ``ONE_A_TEXEL``."""
        view = MapsView()
        view.start, view.depth, view.reference = self.start, self.depth, self.reference
        occupancy = self.occupancy
        view.inside, view.cells = occupancy.inside, occupancy.cells.flatten()
        view.words_per_octant = occupancy.words_per_octant
        view.cell_shift, view.column_shift = occupancy.cell_shift, occupancy.column_shift
        view.levels, view.first_column = len(occupancy.sides), wp.vec3i(*occupancy.first_columns)
        view.size = wp.vec3i(*frame.size)
        view.first_texel = wp.vec3i(*frame.first_texels[:3])
        view.texels_per_unit = frame.scale
        view.texel_offset = wp.vec3(*frame.offset)
        view.vertices, view.faces = geometry.vertices, geometry.faces
        view.linear_steps, view.binary_steps = linear_steps, binary_steps
        return view


_DTYPES = {"start": wp.int32, "depth": wp.float32, "reference": wp.int32}


def _on_device(arrays: dict[str, np.ndarray], device: wp.Device, *, copy: bool) -> list[wp.array]:
    """Start, depth and reference."""
    return [wp.array(arrays[name], dtype=dtype, device=device, copy=copy) for name, dtype in _DTYPES.items()]


def check_fragments(frame: TexelFrame, triangles: int, arrays: dict[str, np.ndarray]) -> None:
    """Check maps that come from a file, for a mesh of so many triangles, before a kernel reads what they point to.

    Raises:
        ValueError, KeyError: they are not sound; the message says what.
    """
    start, depth, reference = (arrays[name] for name in _DTYPES)
    for array, dtype in ((start, np.int32), (depth, np.float32), (reference, np.int32)):
        if array.dtype != dtype or array.ndim != 1:
            raise ValueError("arrays of another type")
    if start.shape != (frame.first_texels[3] + 1,) or start[0] != 0 or not (start[1:] >= start[:-1]).all():
        raise ValueError("texels that do not follow each other")
    if not depth.shape == reference.shape == (int(start[-1]),):
        raise ValueError("fragments for other texels")
    if not (np.isfinite(depth).all() and (reference >= 0).all() and (reference >> 1 < triangles).all()):
        raise ValueError("a depth or a triangle that the mesh does not have")


def check_order(arrays: dict[str, np.ndarray]) -> None:
    """Check that the fragments of each texel are sorted, of maps that :func:`check_fragments` found sound.

    Raises:
        ValueError, KeyError: they are not.
    """
    start, depth = arrays["start"], arrays["depth"]
    falls = np.flatnonzero(depth[1:] < depth[:-1]) + 1
    if not np.isin(falls, start).all():
        raise ValueError("fragments out of order")
