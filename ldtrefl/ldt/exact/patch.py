"""A patch (``patches.py``): part of a triangle's plane, as a parallelogram over one texel of a map."""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.box import CellBox, cell_holding

LARGE = wp.constant(4)
"""Added to the kind of a patch whose triangle is larger than its texel."""


@wp.struct
class Patch:
    """A corner of the parallelogram, and the two edges from it."""

    corner: wp.vec3  # in cells of the survey
    edge_u: wp.vec3
    edge_v: wp.vec3
    kind: int  # the axis of its map, 0 to 2; ``LARGE`` more if the triangle is larger than the texel
    triangle: int


@wp.func
def patch_low(patch: Patch) -> wp.vec3:
    """The low corner of the box about a patch."""
    none = wp.vec3(0.0)
    return patch.corner + wp.min(patch.edge_u, none) + wp.min(patch.edge_v, none)


@wp.func
def patch_high(patch: Patch) -> wp.vec3:
    """The high corner of the box about a patch."""
    none = wp.vec3(0.0)
    return patch.corner + wp.max(patch.edge_u, none) + wp.max(patch.edge_v, none)


@wp.func
def patch_middle(patch: Patch) -> wp.vec3:
    """The middle of a patch."""
    return patch.corner + 0.5 * (patch.edge_u + patch.edge_v)


@wp.func
def patch_normal(patch: Patch) -> wp.vec3:
    """The unit normal of a patch, which is its triangle's."""
    return wp.normalize(wp.cross(patch.edge_u, patch.edge_v))


@wp.func
def cells_of_patch(patch: Patch, grid: wp.vec3i) -> CellBox:
    """The cells of the survey in the box about a patch, which is smaller than a cell."""
    low, high = patch_low(patch), patch_high(patch)
    box = CellBox()
    for axis in range(3):
        box.first[axis] = cell_holding(low[axis], grid[axis])
        box.last[axis] = cell_holding(high[axis], grid[axis])
    return box


@wp.func
def crosses_cell(patch: Patch, cell: wp.vec3i) -> bool:
    """Whether the plane of a patch crosses a cell."""
    normal = wp.cross(patch.edge_u, patch.edge_v)
    middle = wp.vec3(float(cell[0]) + 0.5, float(cell[1]) + 0.5, float(cell[2]) + 0.5)
    reach = 0.5 * (wp.abs(normal[0]) + wp.abs(normal[1]) + wp.abs(normal[2]))
    return wp.abs(wp.dot(normal, middle - patch.corner)) <= reach
