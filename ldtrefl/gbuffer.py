"""Primary visibility: which point of which triangle each pixel sees.

A z-buffer over homogeneous triangles (``raster.py``). Against casting rays through a BVH it needs no BVH, whose build
alone costs more than drawing once; ``tools/gbuffer_choice.py`` measures both.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.binning import CHUNK, chunk_count, gather_lists, launch_chunks
from ldtrefl.camera import CameraView, camera_view, pixels_from_world
from ldtrefl.device_scene import DeviceScene, ObjectRecord
from ldtrefl.raster import (
    highest,
    homogeneous_triangle,
    inverse_depth,
    lowest,
    perspective_weights,
    planar_edge,
    planar_nearness,
)
from ldtrefl.scene import Camera
from ldtrefl.shade import Surface, surface_at
from ldtrefl.vectors import as_double, from_to

LARGE_BOX = wp.constant(4096)
"""Pixels in a triangle's box from which it is drawn in bands of rows, so that all threads share it."""

BAND = wp.constant(8)
"""Rows of such a band."""

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
class GBufferView:
    """What kernels read of a G-buffer."""

    object: wp.array(dtype=wp.int32)  # -1 where nothing is seen
    triangle: wp.array(dtype=wp.int32)
    barycentrics: wp.array(dtype=wp.vec2)  # weights of the second and third corner
    reflector: wp.array(dtype=wp.uint8)  # 1 where a reflector is seen
    camera: CameraView


@launch.kernel
def project_vertices(
    first: int,
    # In:
    vertices: wp.array(dtype=wp.vec3),
    row_x: wp.vec4d,
    row_y: wp.vec4d,
    row_z: wp.vec4d,
    first_vertex: int,
    # Out: (x, y, 1 / depth) in pixels in front of the camera; elsewhere (x depth, y depth, depth)
    corners_out: wp.array(dtype=wp.vec3d),
):
    i = first + wp.tid()
    p = wp.vec4d(wp.float64(vertices[i][0]), wp.float64(vertices[i][1]), wp.float64(vertices[i][2]), wp.float64(1.0))
    x, y, depth = wp.dot(row_x, p), wp.dot(row_y, p), wp.dot(row_z, p)
    corners_out[first_vertex + i] = wp.vec3d(x, y, wp.min(depth, BEHIND))
    if depth > NEAREST:
        nearness = wp.float64(1.0) / depth
        corners_out[first_vertex + i] = wp.vec3d(x * nearness, y * nearness, nearness)


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
def beyond(corner: wp.vec3d, width: int, height: int) -> int:
    """The sides of the view that a corner lies beyond, a bit each (the outcode of Cohen and Sutherland)."""
    x, y = corner[0], corner[1]
    depth = wp.where(corner[2] > BEHIND, wp.float64(1.0), corner[2])
    code = wp.where(x < BEHIND, 1, 0) + wp.where(y < BEHIND, 2, 0)
    code += wp.where(x > depth * wp.float64(width), 4, 0) + wp.where(y > depth * wp.float64(height), 8, 0)
    return code


@wp.func
def pixel_box(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, width: int, height: int) -> PixelBox:
    """The pixels whose centres lie in the box about a projected triangle; all where that has no bounds in the view."""
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
        box.first_y = wp.max(first_pixel(low_y), 0)
        box.last_y = wp.min(last_pixel(high_y), height - 1)
    elif highest(a[2], b[2], c[2]) > BEHIND:
        if (beyond(a, width, height) & beyond(b, width, height) & beyond(c, width, height)) == 0:
            box.last_x = width - 1
            box.last_y = height - 1
    return box


@wp.struct
class ProjectedMesh:
    """An object's projected triangles, and the image."""

    faces: wp.array(dtype=wp.vec3i)
    corners: wp.array(dtype=wp.vec3d)  # of all objects' vertices
    first_vertex: int
    first_triangle: int
    width: int
    height: int


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


@wp.func
def keep_nearest(mesh: ProjectedMesh, triangle: int, x: int, y: int, nearness: float, keys: wp.array(dtype=wp.int64)):
    """Put a triangle's point into a pixel's key."""
    if nearness > 0.0:
        number = wp.int64(mesh.first_triangle + triangle)
        keep_largest(keys, y * mesh.width + x, (wp.int64(wp.cast(nearness, wp.int32)) << wp.int64(32)) | number)


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
        mesh.height,
    )


@launch.kernel
def draw_small_triangles(
    first: int,
    # In:
    mesh: ProjectedMesh,
    # Out: a pixel's key holds 1 / depth in its upper half, the triangle in its lower
    key_out: wp.array(dtype=wp.int64),
    # Out, per chunk: triangles that are too large, and their list
    count_out: wp.array(dtype=wp.int32),
    list_out: wp.array(dtype=wp.int32),
):
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    count = int(0)
    for triangle in range(begin, wp.min(begin + CHUNK, mesh.faces.shape[0])):
        box = triangle_box(mesh, triangle)
        # Most triangles of a dense mesh lie between pixel centres and end here.
        if box.first_x <= box.last_x and box.first_y <= box.last_y:
            if (box.last_x - box.first_x + 1) * (box.last_y - box.first_y + 1) < LARGE_BOX:
                draw_rows(mesh, triangle, box, box.first_y, box.last_y, key_out)
            else:
                list_out[begin + count] = triangle
                count += 1
    count_out[chunk] = count


@launch.kernel
def draw_large_triangles(
    first: int,
    # In:
    mesh: ProjectedMesh,
    large: wp.array(dtype=wp.int32),
    # Out:
    key_out: wp.array(dtype=wp.int64),
):
    i = first + wp.tid()
    bands = (mesh.height + BAND - 1) / BAND
    triangle = large[i / bands]
    box = triangle_box(mesh, triangle)
    band = BAND * (i % bands)
    draw_rows(mesh, triangle, box, wp.max(box.first_y, band), wp.min(box.last_y, band + BAND - 1), key_out)


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
def resolve_pixels(
    first: int,
    # In:
    keys: wp.array(dtype=wp.int64),
    objects: wp.array(dtype=ObjectRecord),
    corners: wp.array(dtype=wp.vec3d),
    width: int,
    # Out:
    object_out: wp.array(dtype=wp.int32),
    triangle_out: wp.array(dtype=wp.int32),
    barycentrics_out: wp.array(dtype=wp.vec2),
    # Out, 0 before:
    reflector_out: wp.array(dtype=wp.uint8),
):
    i = first + wp.tid()
    if keys[i] == wp.int64(0):
        object_out[i] = -1
        triangle_out[i] = -1
        barycentrics_out[i] = wp.vec2(0.0, 0.0)
        return
    number = int(keys[i] & wp.int64(0x7FFFFFFF))
    index = object_of(objects, number)
    triangle = number - objects[index].first_triangle
    face = objects[index].faces[triangle]
    first_vertex = objects[index].first_vertex
    tri = homogeneous_triangle(
        homogeneous(corners[first_vertex + face[0]]),
        homogeneous(corners[first_vertex + face[1]]),
        homogeneous(corners[first_vertex + face[2]]),
    )
    x, y = wp.float64(i % width) + wp.float64(0.5), wp.float64(i / width) + wp.float64(0.5)
    at = perspective_weights(tri, x, y)
    total = at[0] + at[1] + at[2]
    object_out[i] = index
    triangle_out[i] = triangle
    barycentrics_out[i] = wp.vec2(float(at[1] / total), float(at[2] / total))
    if wp.max(objects[index].mirror) > 0.0:
        reflector_out[i] = wp.uint8(1)


@launch.kernel
def find_surfaces(
    first: int,
    # In:
    gbuffer: GBufferView,
    objects: wp.array(dtype=ObjectRecord),
    # Out:
    position_out: wp.array(dtype=wp.vec3d),
    normal_out: wp.array(dtype=wp.vec3),
):
    i = first + wp.tid()
    if gbuffer.object[i] >= 0:
        surface = pixel_surface(gbuffer, objects, i, pixel_view(gbuffer, objects, i))
        position_out[i] = surface.position
        normal_out[i] = surface.normal


@wp.func
def pixel_view(gbuffer: GBufferView, objects: wp.array(dtype=ObjectRecord), pixel: int) -> wp.vec3:
    """Unit direction from the eye to what the pixel sees."""
    index = gbuffer.object[pixel]
    corners = objects[index].faces[gbuffer.triangle[pixel]]
    u, v = gbuffer.barycentrics[pixel][0], gbuffer.barycentrics[pixel][1]
    point = (
        (1.0 - u - v) * objects[index].vertices[corners[0]]
        + u * objects[index].vertices[corners[1]]
        + v * objects[index].vertices[corners[2]]
    )
    position = wp.transform_point(objects[index].device_from_unit, as_double(point))
    return wp.normalize(from_to(gbuffer.camera.eye, position))


@wp.func
def pixel_surface(gbuffer: GBufferView, objects: wp.array(dtype=ObjectRecord), pixel: int, view: wp.vec3) -> Surface:
    """The surface that the pixel sees along unit direction ``view``."""
    uv = gbuffer.barycentrics[pixel]
    return surface_at(objects, gbuffer.object[pixel], gbuffer.triangle[pixel], uv[0], uv[1], view)


@dataclass(eq=False)
class GBuffer:
    """What a camera sees, row by row; positions and normals are made when they are asked for."""

    scene: DeviceScene
    camera: Camera
    view: GBufferView
    """Of (height * width) pixels what each sees, and the camera."""

    @property
    def pixel_count(self) -> int:
        """Pixels of the image."""
        return self.camera.width * self.camera.height

    @functools.cached_property
    def objects(self) -> np.ndarray:
        """(h, w) int32 object numbers, -1 where nothing is seen."""
        return self.view.object.numpy().reshape(self.camera.height, self.camera.width)

    @functools.cached_property
    def triangles(self) -> np.ndarray:
        """(h, w) int32 triangle numbers within the object, -1 where nothing is seen."""
        return self.view.triangle.numpy().reshape(self.camera.height, self.camera.width)

    @functools.cached_property
    def reflector_mask(self) -> np.ndarray:
        """(h, w) bool: pixels that see a reflector."""
        return self.view.reflector.numpy().view(bool).reshape(self.camera.height, self.camera.width)

    @functools.cached_property
    def surfaces(self) -> tuple[wp.array, wp.array]:
        """Positions, (h * w,) vec3d, and shading normals, (h * w,) vec3, of all pixels in device space."""
        device = self.scene.device
        position = wp.zeros(self.pixel_count, dtype=wp.vec3d, device=device)
        normal = wp.zeros(self.pixel_count, dtype=wp.vec3, device=device)
        launch.launch(find_surfaces, self.pixel_count, [self.view, self.scene.records, position, normal], device)
        return position, normal


@dataclass(frozen=True, eq=False)
class Drawing:
    """A z-buffer, and the corners of what is drawn in it."""

    keys: wp.array
    """(h * w,) int64: nearness of what a pixel sees, then its triangle; 0 where nothing is seen."""
    corners: wp.array
    """(all objects' vertices,) vec3d in pixels."""

    @classmethod
    def empty(cls, scene: DeviceScene, camera: Camera) -> Drawing:
        """Nothing drawn yet."""
        keys = wp.zeros(camera.width * camera.height, dtype=wp.int64, device=scene.device)
        return cls(keys, wp.empty(scene.vertex_count, dtype=wp.vec3d, device=scene.device))

    def over(self) -> Drawing:
        """A copy to draw other objects over."""
        return Drawing(wp.clone(self.keys), self.corners)

    def add(self, scene: DeviceScene, camera: Camera, numbers: Iterable[int]) -> None:
        """Draw the objects of these numbers."""
        device, from_world = scene.device, pixels_from_world(camera)
        for entry in (scene.objects[number] for number in numbers):
            mesh, rows = entry.geometry, [wp.vec4d(*row) for row in from_world @ entry.world_from_unit]
            inputs = [mesh.vertices, *rows, entry.record.first_vertex, self.corners]
            launch.launch(project_vertices, len(mesh.vertices), inputs, device)
            triangles = len(mesh.faces)
            projected = ProjectedMesh()
            projected.faces, projected.corners = mesh.faces, self.corners
            projected.first_vertex = entry.record.first_vertex
            projected.first_triangle = entry.record.first_triangle
            projected.width, projected.height = camera.width, camera.height
            counts = wp.zeros(chunk_count(triangles) + 1, dtype=wp.int32, device=device)
            listed = wp.empty(triangles, dtype=wp.int32, device=device)
            launch_chunks(draw_small_triangles, triangles, [projected, self.keys, counts, listed], device)
            if counts.numpy().any():
                large = gather_lists(listed, counts)
                bands = large.shape[0] * -(-camera.height // int(BAND))
                launch.launch(draw_large_triangles, bands, [projected, large, self.keys], device)

    def resolved(self, scene: DeviceScene, camera: Camera) -> GBuffer:
        """What each pixel sees."""
        device, pixels = scene.device, camera.width * camera.height
        view = GBufferView()
        view.object, view.triangle = (wp.empty(pixels, dtype=wp.int32, device=device) for _ in range(2))
        view.barycentrics = wp.empty(pixels, dtype=wp.vec2, device=device)
        view.reflector = wp.zeros(pixels, dtype=wp.uint8, device=device)
        view.camera = camera_view(camera, scene.device_from_world)
        if scene.objects:
            inputs = [self.keys, scene.records, self.corners, camera.width]
            outputs = [view.object, view.triangle, view.barycentrics, view.reflector]
            launch.launch(resolve_pixels, pixels, [*inputs, *outputs], device)
        else:
            view.object.fill_(-1)
            view.triangle.fill_(-1)
        return GBuffer(scene, camera, view)


def draw_gbuffer(scene: DeviceScene, camera: Camera, *, without: int = -1) -> GBuffer:
    """What ``camera`` sees of the scene, object number ``without`` left out."""
    drawing = Drawing.empty(scene, camera)
    drawing.add(scene, camera, [number for number in range(len(scene.objects)) if number != without])
    return drawing.resolved(scene, camera)
