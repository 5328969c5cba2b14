"""What a tree is built over: *records*, which are triangles of the mesh or patches, by number.

From 0 on a record's number is a triangle's; below 0 it is a patch's, -1 for patch 0.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body
from ldtrefl.ldt.exact.patch import LARGE, Patch, patch_high, patch_low, patch_middle, patch_normal
from ldtrefl.ldt.exact.tree import LANES, LARGE_AXIS, PATCH_AXIS_ROW, PATCH_TRIANGLE_ROW, TRIANGLE_NUMBER_ROW


@wp.struct
class Records:
    """The records of a tree, and what they are made from."""

    numbers: wp.array(dtype=wp.int32)  # empty: all triangles
    vertices: wp.array(dtype=wp.vec3)  # unit space
    faces: wp.array(dtype=wp.vec3i)
    patches: wp.array(dtype=Patch)  # in cells of the survey: unit = unit_per_cell * cell + unit_offset
    unit_per_cell: float
    unit_offset: wp.vec3


@wp.struct
class Reference:
    """The box about one record, or about several, as ``binary_tree.h`` has it."""

    low: wp.vec4  # and the bits of their number
    high: wp.vec4  # and how many records there are


AHEAD = 16
"""Records by which the memory of a triangle's corners is asked for ahead of it; that of their numbers twice as many."""

FETCH = """
#if !defined(__CUDA_ARCH__)
    const int* faces = (const int*)records.faces.data;
    const long long last = (long long)order.shape[0] - 1, near = i + AHEAD, far = i + 2 * AHEAD;
    const int coming = order.data[far < last ? far : last], next = order.data[near < last ? near : last];
    if (coming >= 0) __builtin_prefetch(faces + 3 * (long long)coming);
    if (next >= 0)
        for (int k = 0; k < 3; ++k)
            __builtin_prefetch((const float*)records.vertices.data + 3 * (long long)faces[3 * (long long)next + k]);
#endif
"""


@wp.func_native(native_body({"AHEAD": AHEAD}, (), FETCH))
def fetch_ahead(records: Records, order: wp.array(dtype=wp.int32), i: int):
    """Have memory bring the triangles that come after record ``order[i]``: they may lie anywhere in it."""
    ...


@wp.func
def record_number(records: Records, i: int) -> int:
    """The number of the ``i``-th record."""
    if records.numbers.shape[0] > 0:
        return records.numbers[i]
    return i


@wp.func
def patch_in_unit_space(records: Records, record: int) -> Patch:
    """The patch of a record whose number lies below 0."""
    patch = records.patches[-1 - record]
    patch.corner = records.unit_per_cell * patch.corner + records.unit_offset
    patch.edge_u = records.unit_per_cell * patch.edge_u
    patch.edge_v = records.unit_per_cell * patch.edge_v
    return patch


@wp.func
def reference_to(records: Records, record: int) -> Reference:
    """The box about a record."""
    low, high = wp.vec3(0.0), wp.vec3(0.0)
    if record >= 0:
        corners = records.faces[record]
        a, b, c = records.vertices[corners[0]], records.vertices[corners[1]], records.vertices[corners[2]]
        low, high = wp.min(a, wp.min(b, c)), wp.max(a, wp.max(b, c))
    else:
        patch = patch_in_unit_space(records, record)
        low, high = patch_low(patch), patch_high(patch)
    made = Reference()
    made.low = wp.vec4(low[0], low[1], low[2], wp.cast(record, wp.float32))
    made.high = wp.vec4(high[0], high[1], high[2], 1.0)
    return made


@wp.func
def write_patch(records: Records, record: int, at: int, rows: wp.array(dtype=float)):
    """Write a patch into the lane of a block that begins at ``at`` (``tree.py``)."""
    patch = patch_in_unit_space(records, record)
    middle, normal = patch_middle(patch), patch_normal(patch)
    axis = patch.kind % LARGE
    for k in range(3):
        rows[at + k * LANES] = normal[k]
    rows[at + 3 * LANES] = wp.dot(normal, middle)
    rows[at + 4 * LANES] = middle[(axis + 1) % 3]
    rows[at + 5 * LANES] = middle[(axis + 2) % 3]
    rows[at + PATCH_TRIANGLE_ROW * LANES] = wp.cast(patch.triangle, wp.float32)
    rows[at + PATCH_AXIS_ROW * LANES] = float(axis) + wp.where(patch.kind >= LARGE, LARGE_AXIS, 0.0)


@wp.func
def write_triangle(records: Records, record: int, at: int, rows: wp.array(dtype=float)):
    """Write a triangle into the lane of a block that begins at ``at`` (``tree.py``)."""
    corners = records.faces[record]
    for corner in range(3):
        point = records.vertices[corners[corner]]
        for k in range(3):
            rows[at + (3 * corner + k) * LANES] = point[k]
    rows[at + TRIANGLE_NUMBER_ROW * LANES] = wp.cast(record, wp.float32)
