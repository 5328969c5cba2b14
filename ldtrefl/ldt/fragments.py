"""The fragments of a layered depth texture as they lie in memory, and how kernels fetch them.

Three maps, one per axis, stand in one row of texels. Texel ``i`` holds fragments ``start[i]`` to ``start[i + 1]``,
sorted by depth along the axis; two fragments of one depth are sorted by triangle. A fragment is a depth (float32,
texels) and a reference (int32): its triangle's number times 2, plus 1 if the triangle faces up the axis. Normal, UVs
and colour are those of the triangle, at the mesh's resolution. Memory follows the fragments: 8 bytes each, and 4 for
every texel; what ``occupancy.py`` derives from them takes another byte a fragment, and little else.
"""

from __future__ import annotations

import warp as wp

ONE_A_TEXEL = 0
"""In place of a number of ``linear_steps``."""


@wp.struct
class LdtView:
    """A layered depth texture, its mesh, and how to search it."""

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
    linear_steps: int  # of march_linear, or ONE_A_TEXEL
    binary_steps: int


@wp.func
def triangle_of(reference: int) -> int:
    """A fragment's triangle."""
    return reference >> 1
