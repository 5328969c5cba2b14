"""Triangles that cover many pixels: set aside while the others are drawn, then drawn in strips by all threads."""

from __future__ import annotations

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.atomics import take_place
from ldtrefl.frame.pixel_box import pixel_box
from ldtrefl.frame.projection import DrawnObject, corner_of
from ldtrefl.frame.triangle_rows import Target, Triangle, draw_rows
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.triangle_numbers import TriangleNumbers, number_of

LARGE_BOX = wp.constant(4096)
"""Pixels in a triangle's box from which it is drawn in strips of rows, so that all threads share it."""

STRIP = wp.constant(8)
"""Rows of such a strip."""

ROOM = 1 << 16
"""The most large triangles that are set aside. Those that find no room are drawn at once, by whoever meets them."""


@wp.struct
class LargeTriangles:
    """Triangles that are set aside."""

    count: wp.array(dtype=wp.int32)  # (1,) how many, those that found no room counted in
    found: wp.array(dtype=wp.vec2i)  # of each the place of its object among those drawn, and its number in the object


@wp.func
def draw_or_set_aside(target: Target, triangle: Triangle, place: int, index: int, large: LargeTriangles):
    """Draw a triangle, number ``index`` of the object at this place of those drawn, or set it aside."""
    box = pixel_box(triangle.a, triangle.b, triangle.c, target.width, target.first_row, target.end_row)
    if box.first_x <= box.last_x and box.first_y <= box.last_y:
        if (box.last_x - box.first_x + 1) * (box.last_y - box.first_y + 1) >= LARGE_BOX:
            k = take_place(large.count)
            if k < large.found.shape[0]:
                large.found[k] = wp.vec2i(place, index)
                return
        draw_rows(target, triangle, box, box.first_y, box.last_y)


@launch.kernel
def draw_large_triangles(
    first: int,
    # In:
    large: LargeTriangles,
    objects: wp.array(dtype=ObjectRecord),
    drawn: wp.array(dtype=DrawnObject),
    numbers: TriangleNumbers,
    corners: wp.array(dtype=wp.vec3d),
    # Out:
    target: Target,
):
    """Draw one strip of rows of a large triangle."""
    i = first + wp.tid()
    strips = (target.end_row - target.first_row + STRIP - 1) / STRIP
    found = large.found[i / strips]
    one = drawn[found[0]]
    face = objects[one.object].faces[found[1]]
    triangle = Triangle()
    triangle.a = corner_of(one, objects, corners, face[0])
    triangle.b = corner_of(one, objects, corners, face[1])
    triangle.c = corner_of(one, objects, corners, face[2])
    triangle.number = number_of(numbers, one.object, found[1])
    box = pixel_box(triangle.a, triangle.b, triangle.c, target.width, target.first_row, target.end_row)
    strip = target.first_row + STRIP * (i % strips)
    draw_rows(target, triangle, box, wp.max(box.first_y, strip), wp.min(box.last_y, strip + STRIP - 1))


def none_set_aside(device: wp.Device) -> LargeTriangles:
    """Room for large triangles."""
    large = LargeTriangles()
    large.count = wp.zeros(1, dtype=wp.int32, device=device)
    large.found = wp.empty(ROOM, dtype=wp.vec2i, device=device)
    return large


def draw_those_set_aside(
    large: LargeTriangles,
    objects: wp.array,
    drawn: wp.array,
    numbers: TriangleNumbers,
    corners: wp.array,
    target: Target,
) -> None:
    """Draw the triangles that were set aside."""
    count, rows = min(int(large.count.numpy()[0]), ROOM), target.end_row - target.first_row
    inputs = [large, objects, drawn, numbers, corners, target]
    launch.launch(draw_large_triangles, count * -(-rows // int(STRIP)), inputs, objects.device)
