"""The z-buffer: which triangle is nearest in each pixel, and how near.

All objects are drawn by the same three launches, however many there are: their vertices and triangles are handed out
in chunks. A band of a large image (``camera.py``) is drawn with the corners of the whole image's pixels, so it has its
bits. The triangles are those of ``raster.py``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK
from ldtrefl.geometry.perspective_raster import (
    highest,
    homogeneous_triangle,
    inverse_depth,
    lowest,
    perspective_weights,
    planar_edge,
    planar_nearness,
)
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import Band, pixels_from_world, whole_image
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord

LARGE_BOX = wp.constant(4096)
"""Pixels in a triangle's box from which it is drawn in strips of rows, so that all threads share it."""

STRIP = wp.constant(8)
"""Rows of such a strip."""

EDGE_SLACK = wp.constant(wp.float64(1.0e-6))
"""Pixels by which a triangle's box is widened, for centres that lie on its edge up to rounding."""

GUARD = wp.constant(wp.float64(1 << 20))
"""Pixels about the image within which a triangle is drawn in the plane; others are drawn homogeneous."""

WIDE = wp.constant(3)
"""Pixels across a triangle's box from which its rows are cut to what lies between its edges; narrower ones are tested
faster than cut."""

LEAST_AREA = wp.constant(wp.float64(4.0))
"""Twice a triangle's square pixels from which the sign of its area is beyond rounding, and its rows are cut."""

LEAST_RISE = wp.constant(wp.float64(0.25))
"""Rows that an edge crosses at least if rows are cut at it: flatter ones cross a row anywhere, up to rounding."""

CUT_SLACK = wp.constant(wp.float64(1.0 / 64.0))
"""Pixels by which rows are cut too long: twice the rounding at edges ``2 * GUARD`` long that rise by ``LEAST_RISE``."""

BEHIND = wp.constant(wp.float64(0.0))
"""Depth up to which a point is not in front of the camera."""

NEAREST = wp.constant(wp.float64(1.0e-300))
"""Depth from which 1 / depth is finite."""


@wp.struct
class Chunks:
    """Vertices or triangles of the objects that are drawn, up to ``CHUNK`` of one object in each."""

    place: wp.array(dtype=wp.int32)  # of the object among those drawn
    object: wp.array(dtype=wp.int32)
    begin: wp.array(dtype=wp.int32)  # the chunk's first vertex or triangle in the object


@launch.kernel
def project_vertices(
    first: int,
    # In:
    chunks: Chunks,
    objects: wp.array(dtype=ObjectRecord),
    rows: wp.array(dtype=wp.vec4d),  # three of each object drawn: pixels from its unit space
    # Out: (x, y, 1 / depth) in pixels in front of the camera; elsewhere (x depth, y depth, depth)
    corners_out: wp.array(dtype=wp.vec3d),
):
    chunk = first + wp.tid()
    index = chunks.object[chunk]
    vertices = objects[index].vertices
    first_vertex = objects[index].first_vertex
    has_outliers = objects[index].exact_vertices.shape[0] > 0
    place = 3 * chunks.place[chunk]
    row_x, row_y, row_z = rows[place], rows[place + 1], rows[place + 2]
    i = int(chunks.begin[chunk])
    end = wp.min(i + CHUNK, vertices.shape[0])
    while i < end:
        p = wp.vec4d(
            wp.float64(vertices[i][0]), wp.float64(vertices[i][1]), wp.float64(vertices[i][2]), wp.float64(1.0)
        )
        if has_outliers:
            exact = objects[index].exact_vertices[i]
            p = wp.vec4d(exact[0], exact[1], exact[2], wp.float64(1.0))
        x, y, depth = wp.dot(row_x, p), wp.dot(row_y, p), wp.dot(row_z, p)
        corner = wp.vec3d(x, y, wp.min(depth, BEHIND))
        if depth > NEAREST:
            nearness = wp.float64(1.0) / depth
            corner = wp.vec3d(x * nearness, y * nearness, nearness)
        corners_out[first_vertex + i] = corner
        i += 1


@wp.func
def homogeneous(corner: wp.vec3d) -> wp.vec3d:
    """(x depth, y depth, depth) of what ``project_vertices`` wrote."""
    if corner[2] > BEHIND:
        depth = wp.float64(1.0) / corner[2]
        return wp.vec3d(corner[0] * depth, corner[1] * depth, depth)
    return corner


@wp.struct
class PixelBox:
    """The pixels that a triangle may cover; empty if the first is past the last."""

    first_x: int
    last_x: int
    first_y: int
    last_y: int
    planar: bool  # all corners lie in front of the camera and within the guard


@wp.func
def first_pixel(low: wp.float64) -> int:
    """The first pixel whose centre is not below ``low``, up to rounding; ``low`` within the guard."""
    return int(low + (GUARD + wp.float64(0.5) - EDGE_SLACK)) - int(GUARD)


@wp.func
def last_pixel(high: wp.float64) -> int:
    """The last pixel whose centre is not above ``high``, up to rounding; ``high`` within the guard."""
    return int(high + (GUARD - wp.float64(0.5) + EDGE_SLACK)) - int(GUARD)


@wp.func
def beyond(corner: wp.vec3d, width: int, first_row: int, end_row: int) -> int:
    """The sides of the band that a corner lies beyond, a bit each (the outcode of Cohen and Sutherland)."""
    x, y = corner[0], corner[1]
    depth = wp.where(corner[2] > BEHIND, wp.float64(1.0), corner[2])
    code = wp.where(x < BEHIND, 1, 0) + wp.where(y < depth * wp.float64(first_row), 2, 0)
    code += wp.where(x > depth * wp.float64(width), 4, 0) + wp.where(y > depth * wp.float64(end_row), 8, 0)
    return code


@wp.func
def pixel_box(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, width: int, first_row: int, end_row: int) -> PixelBox:
    """The band's pixels whose centres lie in the box about a projected triangle; all where that has no bounds in the
    view."""
    box = PixelBox()
    box.last_x = -1
    farthest = lowest(a[2], b[2], c[2])
    low_x, high_x = lowest(a[0], b[0], c[0]), highest(a[0], b[0], c[0])
    low_y, high_y = lowest(a[1], b[1], c[1]), highest(a[1], b[1], c[1])
    limit = GUARD - wp.float64(1.0)
    box.planar = farthest > BEHIND and low_x > -limit and low_y > -limit and high_x < limit and high_y < limit
    if box.planar:
        box.first_x = wp.max(first_pixel(low_x), 0)
        box.last_x = wp.min(last_pixel(high_x), width - 1)
        box.first_y = wp.max(first_pixel(low_y), first_row)
        box.last_y = wp.min(last_pixel(high_y), end_row - 1)
    elif highest(a[2], b[2], c[2]) > BEHIND:
        codes = beyond(a, width, first_row, end_row) & beyond(b, width, first_row, end_row)
        if (codes & beyond(c, width, first_row, end_row)) == 0:
            box.last_x = width - 1
            box.first_y = first_row
            box.last_y = end_row - 1
    return box


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


KEEP_LARGEST = """
#if defined(__CUDA_ARCH__)
    atomicMax((long long*)(values.data + index), (long long)value);
#else
    auto* place = values.data + index;
    auto seen = __atomic_load_n(place, __ATOMIC_RELAXED);
    while (seen < value &&
        !__atomic_compare_exchange_n(place, &seen, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
#endif
"""


@wp.func_native(KEEP_LARGEST)
def keep_largest(values: wp.array(dtype=wp.int64), index: int, value: wp.int64):
    """``values[index] = max(values[index], value)``, whoever else does the same: Warp's own is not atomic on the CPU.

    The largest does not depend on the order, so the image does not depend on the threads.
    """
    ...


TAKE_PLACE = """
#if defined(__CUDA_ARCH__)
    return atomicAdd((int*)count.data, 1);
#else
    return __atomic_fetch_add((int*)count.data, 1, __ATOMIC_RELAXED);
#endif
"""


@wp.func_native(TAKE_PLACE)
def take_place(count: wp.array(dtype=wp.int32)) -> wp.int32:
    """``count[0]``, which is then one more, whoever else does the same: Warp's own is not atomic on the CPU."""
    ...


@wp.func
def keep_nearest(mesh: ProjectedMesh, triangle: int, x: int, y: int, nearness: float, keys: wp.array(dtype=wp.int64)):
    """Put a triangle's point into a pixel's key."""
    if nearness > 0.0:
        number = wp.int64(mesh.first_triangle + triangle)
        place = (y - mesh.first_row) * mesh.width + x
        keep_largest(keys, place, (wp.int64(wp.cast(nearness, wp.int32)) << wp.int64(32)) | number)


@wp.func
def row_bounds(p: wp.vec3d, q: wp.vec3d, area: wp.float64) -> wp.vec4d:
    """What an edge leaves of row y: from ``[0] + [1] y`` to ``[2] + [3] y``. ``area`` is the triangle's, twice."""
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


@wp.func
def object_of(objects: wp.array(dtype=ObjectRecord), triangle: int) -> int:
    """The object that holds the triangle of this number, by bisection."""
    low = int(0)
    high = objects.shape[0]
    while high - low > 1:
        middle = (low + high) / 2
        if objects[middle].first_triangle <= triangle:
            low = middle
        else:
            high = middle
    return low


@launch.kernel
def draw_small_triangles(
    first: int,
    # In:
    chunks: Chunks,
    objects: wp.array(dtype=ObjectRecord),
    corners: wp.array(dtype=wp.vec3d),
    width: int,
    first_row: int,
    end_row: int,
    # Out: a pixel's key holds 1 / depth in its upper half, the triangle in its lower
    key_out: wp.array(dtype=wp.int64),
    # Out: how many triangles are too large, and their numbers among all objects' in any order
    count_out: wp.array(dtype=wp.int32),
    list_out: wp.array(dtype=wp.int32),
):
    chunk = first + wp.tid()
    mesh = object_triangles(objects, chunks.object[chunk], corners, width, first_row, end_row)
    begin = chunks.begin[chunk]
    for triangle in range(begin, wp.min(begin + CHUNK, mesh.faces.shape[0])):
        box = triangle_box(mesh, triangle)
        # Most triangles of a dense mesh lie between pixel centres and end here.
        if box.first_x <= box.last_x and box.first_y <= box.last_y:
            if (box.last_x - box.first_x + 1) * (box.last_y - box.first_y + 1) < LARGE_BOX:
                draw_rows(mesh, triangle, box, box.first_y, box.last_y, key_out)
            else:
                list_out[take_place(count_out)] = mesh.first_triangle + triangle


@launch.kernel
def draw_large_triangles(
    first: int,
    # In:
    large: wp.array(dtype=wp.int32),
    objects: wp.array(dtype=ObjectRecord),
    corners: wp.array(dtype=wp.vec3d),
    width: int,
    first_row: int,
    end_row: int,
    # Out:
    key_out: wp.array(dtype=wp.int64),
):
    i = first + wp.tid()
    strips = (end_row - first_row + STRIP - 1) / STRIP
    number = large[i / strips]
    index = object_of(objects, number)
    mesh = object_triangles(objects, index, corners, width, first_row, end_row)
    triangle = number - mesh.first_triangle
    box = triangle_box(mesh, triangle)
    strip = first_row + STRIP * (i % strips)
    draw_rows(mesh, triangle, box, wp.max(box.first_y, strip), wp.min(box.last_y, strip + STRIP - 1), key_out)


def _chunks(numbers: np.ndarray, counts: np.ndarray, device: wp.Device) -> tuple[Any, int]:
    """(``Chunks``, how many) of the objects of these numbers, which have so many vertices or triangles each."""
    chunks = -(-counts // int(CHUNK))
    place = np.repeat(np.arange(len(numbers)), chunks)
    begin = int(CHUNK) * (np.arange(len(place)) - np.repeat(np.cumsum(chunks) - chunks, chunks))
    made = Chunks()
    made.place, made.object, made.begin = (
        wp.array(values.astype(np.int32), dtype=wp.int32, device=device) for values in (place, numbers[place], begin)
    )
    return made, len(place)


@dataclass(frozen=True, eq=False)
class Drawing:
    """A z-buffer of a band, and the corners of what is drawn in it."""

    keys: wp.array
    """(h * w,) int64: nearness of what a pixel sees, then its triangle; 0 where nothing is seen."""
    corners: wp.array
    """(all objects' vertices,) vec3d in pixels of the whole image."""
    band: Band

    @classmethod
    def empty(cls, scene: DeviceScene, camera: Camera, band: Band | None = None) -> Drawing:
        """Nothing drawn yet; of the whole image if no band is given."""
        corners = wp.empty(scene.vertex_count, dtype=wp.vec3d, device=scene.device)
        return cls._blank(scene, camera, band or whole_image(camera), corners)

    @classmethod
    def _blank(cls, scene: DeviceScene, camera: Camera, band: Band, corners: wp.array) -> Drawing:
        keys = wp.zeros(camera.width * band.rows, dtype=wp.int64, device=scene.device)
        return cls(keys, corners, band)

    def over(self) -> Drawing:
        """A copy to draw other objects over."""
        return Drawing(wp.clone(self.keys), self.corners, self.band)

    def of_band(self, scene: DeviceScene, camera: Camera, band: Band) -> Drawing:
        """Nothing drawn yet in another band, the corners the same."""
        return self._blank(scene, camera, band, self.corners)

    def add(self, scene: DeviceScene, camera: Camera, numbers: Iterable[int]) -> None:
        """Draw the objects of these numbers."""
        listed = list(numbers)
        self.project(scene, camera, listed)
        self.draw(scene, camera, listed)

    def project(self, scene: DeviceScene, camera: Camera, numbers: Sequence[int]) -> None:
        """Find the corners of the objects of these numbers."""
        entries, device, from_world = [scene.objects[k] for k in numbers], scene.device, pixels_from_world(camera)
        if not entries:
            return
        rows = np.array([from_world @ entry.world_from_unit for entry in entries]).reshape(-1, 4)
        counts = np.array([entry.vertex_count for entry in entries])
        chunks, count = _chunks(np.array(numbers), counts, device)
        inputs = [chunks, scene.records, wp.array(rows, dtype=wp.vec4d, device=device), self.corners]
        launch.launch(project_vertices, count, inputs, device)

    def draw(self, scene: DeviceScene, camera: Camera, numbers: Sequence[int]) -> None:
        """Draw the objects of these numbers, whose corners are known."""
        device, counts = scene.device, np.array([scene.objects[k].triangle_count for k in numbers], np.int64)
        chunks, count = _chunks(np.array(numbers, np.int64), counts, device)
        large = wp.zeros(1, dtype=wp.int32, device=device)
        listed = wp.empty(int(counts.sum()), dtype=wp.int32, device=device)
        target = [scene.records, self.corners, camera.width, self.band.first_row, self.band.first_row + self.band.rows]
        launch.launch(draw_small_triangles, count, [chunks, *target, self.keys, large, listed], device)
        strips = int(large.numpy()[0]) * -(-self.band.rows // int(STRIP))
        launch.launch(draw_large_triangles, strips, [listed, *target, self.keys], device)
