"""Drawing a projected triangle into a z-buffer, row by row.

The key of a pixel holds 1 / depth in its upper half and the triangle's number in its lower: the larger key is nearer.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.atomics import keep_largest
from ldtrefl.frame.pixel_box import GUARD, PixelBox, first_pixel, last_pixel, pixel_box
from ldtrefl.frame.projection import BEHIND, homogeneous
from ldtrefl.geometry.perspective_raster import (
    highest,
    homogeneous_triangle,
    inverse_depth,
    lowest,
    perspective_weights,
    planar_edge,
    planar_nearness,
)
from ldtrefl.world.records import ObjectRecord

WIDE = wp.constant(3)
"""Pixels across a triangle's box from which its rows are cut to what lies between its edges; narrower ones are tested
faster than cut."""

LEAST_AREA = wp.constant(wp.float64(4.0))
"""Twice the area, in square pixels, from which a triangle's rows are cut: rounding cannot change its sign."""

LEAST_RISE = wp.constant(wp.float64(0.25))
"""Rows are cut at edges that rise by more rows than this: where a flatter edge crosses a row is lost in rounding."""

CUT_SLACK = wp.constant(wp.float64(1.0 / 64.0))
"""Pixels by which cut rows are left too long: twice the rounding at an edge ``2 * GUARD`` long that rises by
``LEAST_RISE``."""


@wp.struct
class ProjectedMesh:
    """An object's projected triangles, and the band that they are drawn to."""

    faces: wp.array(dtype=wp.vec3i)
    corners: wp.array(dtype=wp.vec3d)  # of all objects' vertices
    first_vertex: int
    first_triangle: int
    width: int
    first_row: int
    end_row: int


@wp.func
def keep_nearest(mesh: ProjectedMesh, triangle: int, x: int, y: int, nearness: float, keys: wp.array(dtype=wp.int64)):
    """Put a triangle's point into a pixel's key."""
    if nearness > 0.0:
        number = wp.int64(mesh.first_triangle + triangle)
        place = (y - mesh.first_row) * mesh.width + x
        keep_largest(keys, place, (wp.int64(wp.cast(nearness, wp.int32)) << wp.int64(32)) | number)


@wp.func
def row_bounds(p: wp.vec3d, q: wp.vec3d, area: wp.float64) -> wp.vec4d:
    """The part of row y on the inner side of an edge: from x = ``[0] + [1] y`` to ``[2] + [3] y``. ``area`` is twice
    the triangle's."""
    rise = q[1] - p[1]
    bounds = wp.vec4d(-GUARD, BEHIND, GUARD, BEHIND)
    if wp.abs(rise) > LEAST_RISE and wp.abs(area) > LEAST_AREA:
        slope = (q[0] - p[0]) / rise
        offset = p[0] - slope * p[1]
        if (rise > BEHIND) == (area > BEHIND):
            bounds[2] = offset + CUT_SLACK
            bounds[3] = slope
        else:
            bounds[0] = offset - CUT_SLACK
            bounds[1] = slope
    return bounds


@wp.func
def draw_cut_rows(
    mesh: ProjectedMesh,
    triangle: int,
    a: wp.vec3d,
    b: wp.vec3d,
    c: wp.vec3d,
    box: PixelBox,
    first_y: int,
    last_y: int,
    keys: wp.array(dtype=wp.int64),
):
    """Draw a planar triangle's pixels, testing of each row only those between its edges."""
    half = wp.float64(0.5)
    area = planar_edge(a, b, c[0], c[1])
    ab, bc, ca = row_bounds(a, b, area), row_bounds(b, c, area), row_bounds(c, a, area)
    begin, end = wp.float64(box.first_x), wp.float64(box.last_x) + wp.float64(1.0)
    y = int(first_y)
    while y <= last_y:
        at_y = wp.float64(y) + half
        low = highest(ab[0] + ab[1] * at_y, bc[0] + bc[1] * at_y, ca[0] + ca[1] * at_y)
        high = lowest(ab[2] + ab[3] * at_y, bc[2] + bc[3] * at_y, ca[2] + ca[3] * at_y)
        x = first_pixel(lowest(highest(low, begin, begin), end, end))
        last_x = last_pixel(highest(lowest(high, end, end), begin, begin))
        while x <= last_x:
            nearness = planar_nearness(a, b, c, wp.float64(x) + half, at_y)
            keep_nearest(mesh, triangle, x, y, nearness, keys)
            x += 1
        y += 1


@wp.func
def draw_rows(
    mesh: ProjectedMesh, triangle: int, box: PixelBox, first_y: int, last_y: int, keys: wp.array(dtype=wp.int64)
):
    """Draw a triangle's pixels from row ``first_y`` to ``last_y``."""
    face = mesh.faces[triangle]
    a = mesh.corners[mesh.first_vertex + face[0]]
    b = mesh.corners[mesh.first_vertex + face[1]]
    c = mesh.corners[mesh.first_vertex + face[2]]
    half = wp.float64(0.5)
    if box.planar and box.last_x - box.first_x + 1 >= WIDE:
        draw_cut_rows(mesh, triangle, a, b, c, box, first_y, last_y, keys)
    elif box.planar:
        # Not by ``range``, whose loop tests its step's sign each time: most triangles cover a pixel or two.
        y = int(first_y)
        while y <= last_y:
            x = int(box.first_x)
            while x <= box.last_x:
                nearness = planar_nearness(a, b, c, wp.float64(x) + half, wp.float64(y) + half)
                keep_nearest(mesh, triangle, x, y, nearness, keys)
                x += 1
            y += 1
    else:
        tri = homogeneous_triangle(homogeneous(a), homogeneous(b), homogeneous(c))
        for y in range(first_y, last_y + 1):
            for x in range(box.first_x, box.last_x + 1):
                at = perspective_weights(tri, wp.float64(x) + half, wp.float64(y) + half)
                if wp.min(at) >= BEHIND and tri.volume != BEHIND:
                    keep_nearest(mesh, triangle, x, y, inverse_depth(tri, at), keys)


@wp.func
def triangle_box(mesh: ProjectedMesh, triangle: int) -> PixelBox:
    """:func:`pixel_box` of a triangle."""
    face = mesh.faces[triangle]
    return pixel_box(
        mesh.corners[mesh.first_vertex + face[0]],
        mesh.corners[mesh.first_vertex + face[1]],
        mesh.corners[mesh.first_vertex + face[2]],
        mesh.width,
        mesh.first_row,
        mesh.end_row,
    )


@wp.func
def object_triangles(
    objects: wp.array(dtype=ObjectRecord),
    index: int,
    corners: wp.array(dtype=wp.vec3d),
    width: int,
    first_row: int,
    end_row: int,
) -> ProjectedMesh:
    """The projected triangles of an object."""
    mesh = ProjectedMesh()
    mesh.faces = objects[index].faces
    mesh.corners = corners
    mesh.first_vertex = objects[index].first_vertex
    mesh.first_triangle = objects[index].first_triangle
    mesh.width = width
    mesh.first_row = first_row
    mesh.end_row = end_row
    return mesh
