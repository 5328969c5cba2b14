"""The fragments of a layered depth texture as they lie in memory, and how kernels fetch them.

Three maps, one per axis, stand in one row of texels. Texel ``i`` holds fragments ``start[i]`` to ``start[i + 1]``,
sorted by depth along the axis; two fragments of one depth are sorted by triangle. A fragment is a depth (float32,
texels) and a reference (int32): its triangle's number times 2, plus 1 if the triangle faces up the axis. Normal, UVs
and colour are those of the triangle, at the mesh's resolution. Memory follows the fragments: 8 bytes each, and 5 for
every texel.
"""

from __future__ import annotations

import warp as wp


@wp.struct
class LdtView:
    """A layered depth texture, its mesh, and how to search it."""

    start: wp.array(dtype=wp.int32)
    depth: wp.array(dtype=wp.float32)
    reference: wp.array(dtype=wp.int32)
    balanced: wp.array(dtype=wp.uint8)  # per texel: 1 if as many fragments face up as down
    size: wp.vec3i  # texels along x, y, z
    first_texel: wp.vec3i  # of each axis' map
    texels_per_unit: float  # texel = texels_per_unit * unit + texel_offset
    texel_offset: wp.vec3
    vertices: wp.array(dtype=wp.vec3)  # unit space
    faces: wp.array(dtype=wp.vec3i)
    linear_steps: int  # of march_linear
    binary_steps: int


@wp.func
def texel_number(view: LdtView, axis: int, u: float, v: float) -> int:
    """The texel of the map of ``axis`` that holds (u, v); points outside count to the nearest."""
    columns, rows = view.size[(axis + 1) % 3], view.size[(axis + 2) % 3]
    column = wp.clamp(int(wp.floor(u)), 0, columns - 1)
    row = wp.clamp(int(wp.floor(v)), 0, rows - 1)
    return view.first_texel[axis] + row * columns + column


@wp.func
def triangle_of(reference: int) -> int:
    """A fragment's triangle."""
    return reference >> 1
