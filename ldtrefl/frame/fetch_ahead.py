"""Having memory bring what a run of pixels will read, before the first of them is looked at.

Pixels that see a mesh of millions of triangles see one each, which may lie anywhere in memory. If each waits for its
own, a processor does little else; asked for together, they come together. On CUDA other threads work meanwhile, and
nothing is asked for.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.frame.projection import DrawnObject
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.triangle_numbers import TriangleNumbers, first_triangle_of, object_of

FACE = """
#if !defined(__CUDA_ARCH__)
    __builtin_prefetch((const int*)record.faces.data + 3 * (size_t)triangle);
#endif
"""
CORNERS = """
#if !defined(__CUDA_ARCH__)
    const int* face = (const int*)record.faces.data + 3 * (size_t)triangle;
    for (int k = 0; k < 3; ++k) {
        if (first_corner < 0) __builtin_prefetch((const float*)record.vertices.data + 3 * (size_t)face[k]);
        else __builtin_prefetch((const double*)corners.data + 3 * ((size_t)first_corner + face[k]));
    }
#endif
"""


@wp.func_native(FACE)
def fetch_face(record: ObjectRecord, triangle: int):
    """Have memory bring the numbers of a triangle's corners."""
    ...


@wp.func_native(CORNERS)
def fetch_corners(record: ObjectRecord, triangle: int, first_corner: int, corners: wp.array(dtype=wp.vec3d)):
    """Have memory bring a triangle's corners: those that are kept, or else the vertices."""
    ...


@wp.func
def number_in(key: wp.int64) -> int:
    """The number that leads back to a triangle."""
    return int(key & wp.int64(0x7FFFFFFF))


@wp.func
def fetch_triangles(
    keys: wp.array(dtype=wp.int64),
    begin: int,
    end: int,
    objects: wp.array(dtype=ObjectRecord),
    drawn: wp.array(dtype=DrawnObject),
    place_of: wp.array(dtype=wp.int32),
    numbers: TriangleNumbers,
    corners: wp.array(dtype=wp.vec3d),
):
    """Have memory bring the triangles that the pixels from ``begin`` to ``end`` see, by their keys."""
    for fetches_corners in range(2):
        before = int(-1)
        for i in range(begin, end):
            number = number_in(keys[i])
            if keys[i] != wp.int64(0) and number != before:
                index = object_of(numbers, number)
                triangle = first_triangle_of(numbers, index, number)
                if fetches_corners == 0:
                    fetch_face(objects[index], triangle)
                else:
                    fetch_corners(objects[index], triangle, drawn[place_of[index]].first_corner, corners)
                before = number
