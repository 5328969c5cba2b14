"""Primary visibility: which point of which triangle each pixel sees.

A z-buffer over homogeneous triangles (``raster.py``). Against casting rays through a BVH it needs no BVH, whose build
alone costs more than drawing once; ``tools/gbuffer_choice.py`` measures both.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.binning import list_items
from ldtrefl.camera import CameraView, camera_view, pixels_from_world
from ldtrefl.device_scene import DeviceScene, ObjectRecord
from ldtrefl.raster import homogeneous_triangle, inverse_depth, perspective_weights
from ldtrefl.scene import Camera
from ldtrefl.shade import surface_at

BAND = wp.constant(8)
"""Rows that a thread draws before it leaves as many to each of the others: an object is spread over all threads."""

EDGE_SLACK = wp.constant(wp.float64(1.0e-6))
"""Pixels by which a triangle's box is widened, for centres that lie on its edge up to rounding."""

BEHIND = wp.constant(wp.float64(0.0))
"""Depth up to which a point is not in front of the camera."""


@wp.struct
class GBufferView:
    """What kernels read of a G-buffer."""

    object: wp.array(dtype=wp.int32)  # -1 where nothing is seen
    triangle: wp.array(dtype=wp.int32)
    barycentrics: wp.array(dtype=wp.vec2)  # weights of the second and third corner
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
    # Out:
    corners_out: wp.array(dtype=wp.vec3d),
):
    i = first + wp.tid()
    p = wp.vec4d(wp.float64(vertices[i][0]), wp.float64(vertices[i][1]), wp.float64(vertices[i][2]), wp.float64(1.0))
    corners_out[first_vertex + i] = wp.vec3d(wp.dot(row_x, p), wp.dot(row_y, p), wp.dot(row_z, p))


@wp.struct
class PixelBox:
    """The pixels that a triangle may cover; empty if the first is past the last."""

    first_x: int
    last_x: int
    first_y: int
    last_y: int


@wp.func
def clamped_pixel(x: wp.float64, last: int) -> int:
    """A pixel number brought to -1 .. last + 1 before it is turned into an integer."""
    return int(wp.clamp(x, wp.float64(-1.0), wp.float64(last + 1)))


@wp.func
def pixel_box(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, width: int, height: int) -> PixelBox:
    """The pixels whose centres lie in the box about a projected triangle."""
    box = PixelBox()
    box.last_x = -1
    w, h = wp.float64(width), wp.float64(height)
    # Wholly behind the camera, or wholly beyond one side of the view?
    if a[2] <= BEHIND and b[2] <= BEHIND and c[2] <= BEHIND:
        return box
    zero = wp.float64(0.0)
    if (a[0] < zero and b[0] < zero and c[0] < zero) or (a[1] < zero and b[1] < zero and c[1] < zero):
        return box
    if (a[0] > w * a[2] and b[0] > w * b[2] and c[0] > w * c[2]) or (
        a[1] > h * a[2] and b[1] > h * b[2] and c[1] > h * c[2]
    ):
        return box
    box.last_x = width - 1
    box.last_y = height - 1
    if a[2] > BEHIND and b[2] > BEHIND and c[2] > BEHIND:
        ax, bx, cx = a[0] / a[2], b[0] / b[2], c[0] / c[2]
        ay, by, cy = a[1] / a[2], b[1] / b[2], c[1] / c[2]
        slack = wp.float64(0.5) + EDGE_SLACK
        under = wp.float64(0.5) - EDGE_SLACK
        box.first_x = wp.max(clamped_pixel(wp.ceil(wp.min(ax, wp.min(bx, cx)) - slack), width), 0)
        box.last_x = wp.min(clamped_pixel(wp.floor(wp.max(ax, wp.max(bx, cx)) - under), width), width - 1)
        box.first_y = wp.max(clamped_pixel(wp.ceil(wp.min(ay, wp.min(by, cy)) - slack), height), 0)
        box.last_y = wp.min(clamped_pixel(wp.floor(wp.max(ay, wp.max(by, cy)) - under), height), height - 1)
    return box


@wp.struct
class ProjectedMesh:
    """An object's triangles in homogeneous pixel coordinates, and the image."""

    faces: wp.array(dtype=wp.vec3i)
    corners: wp.array(dtype=wp.vec3d)  # of all objects' vertices
    first_vertex: int
    first_triangle: int
    width: int
    height: int


@launch.kernel
def find_visible(
    first: int,
    # In:
    mesh: ProjectedMesh,
    # Out: 1 where the triangle may cover a pixel's centre, and the pixels it may cover
    visible_out: wp.array(dtype=wp.int32),
    box_out: wp.array(dtype=PixelBox),
):
    triangle = first + wp.tid()
    face = mesh.faces[triangle]
    box = pixel_box(
        mesh.corners[mesh.first_vertex + face[0]],
        mesh.corners[mesh.first_vertex + face[1]],
        mesh.corners[mesh.first_vertex + face[2]],
        mesh.width,
        mesh.height,
    )
    if box.first_x <= box.last_x and box.first_y <= box.last_y:
        visible_out[triangle] = 1
        box_out[triangle] = box


@launch.kernel
def draw_triangles(
    part: int,
    parts: int,
    # In:
    mesh: ProjectedMesh,
    visible: wp.array(dtype=wp.int32),
    boxes: wp.array(dtype=PixelBox),
    # Out: a pixel's key holds 1 / depth in its upper half, the triangle in its lower
    key_out: wp.array(dtype=wp.int64),
):
    triangle = visible[wp.tid()]
    box = boxes[triangle]
    if box.first_y / BAND == box.last_y / BAND and (box.first_y / BAND) % parts != part:
        return
    face = mesh.faces[triangle]
    a = mesh.corners[mesh.first_vertex + face[0]]
    b = mesh.corners[mesh.first_vertex + face[1]]
    c = mesh.corners[mesh.first_vertex + face[2]]
    tri = homogeneous_triangle(a, b, c)
    if tri.volume == wp.float64(0.0):
        return
    zero = wp.float64(0.0)
    for y in range(box.first_y, box.last_y + 1):
        if (y / BAND) % parts == part:
            for x in range(box.first_x, box.last_x + 1):
                at = perspective_weights(tri, wp.float64(x) + wp.float64(0.5), wp.float64(y) + wp.float64(0.5))
                if at[0] >= zero and at[1] >= zero and at[2] >= zero:
                    nearness = inverse_depth(tri, at)
                    if nearness > 0.0:
                        number = wp.int64(mesh.first_triangle + triangle)
                        key = (wp.int64(wp.cast(nearness, wp.int32)) << wp.int64(32)) | number
                        wp.atomic_max(key_out, y * mesh.width + x, key)


@wp.func
def object_of(first_triangles: wp.array(dtype=wp.int32), triangle: int) -> int:
    """The object that holds the triangle of this number, by bisection."""
    low = int(0)
    high = first_triangles.shape[0]
    while high - low > 1:
        middle = (low + high) / 2
        if first_triangles[middle] <= triangle:
            low = middle
        else:
            high = middle
    return low


@launch.kernel
def resolve_pixels(
    first: int,
    # In:
    keys: wp.array(dtype=wp.int64),
    first_triangles: wp.array(dtype=wp.int32),
    first_vertices: wp.array(dtype=wp.int32),
    objects: wp.array(dtype=ObjectRecord),
    corners: wp.array(dtype=wp.vec3d),
    width: int,
    # Out:
    object_out: wp.array(dtype=wp.int32),
    triangle_out: wp.array(dtype=wp.int32),
    barycentrics_out: wp.array(dtype=wp.vec2),
):
    i = first + wp.tid()
    if keys[i] == wp.int64(0):
        object_out[i] = -1
        triangle_out[i] = -1
        return
    number = int(keys[i] & wp.int64(0x7FFFFFFF))
    index = object_of(first_triangles, number)
    triangle = number - first_triangles[index]
    face = objects[index].faces[triangle]
    tri = homogeneous_triangle(
        corners[first_vertices[index] + face[0]],
        corners[first_vertices[index] + face[1]],
        corners[first_vertices[index] + face[2]],
    )
    x, y = wp.float64(i % width) + wp.float64(0.5), wp.float64(i / width) + wp.float64(0.5)
    at = perspective_weights(tri, x, y)
    total = at[0] + at[1] + at[2]
    object_out[i] = index
    triangle_out[i] = triangle
    barycentrics_out[i] = wp.vec2(float(at[1] / total), float(at[2] / total))


@launch.kernel
def find_surfaces(
    first: int,
    # In:
    gbuffer: GBufferView,
    objects: wp.array(dtype=ObjectRecord),
    # Out:
    position_out: wp.array(dtype=wp.vec3),
    normal_out: wp.array(dtype=wp.vec3),
):
    i = first + wp.tid()
    if gbuffer.object[i] >= 0:
        view = pixel_view(gbuffer, objects, i)
        surface = surface_at(
            objects,
            gbuffer.object[i],
            gbuffer.triangle[i],
            gbuffer.barycentrics[i][0],
            gbuffer.barycentrics[i][1],
            view,
        )
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
    return wp.normalize(wp.transform_point(objects[index].device_from_unit, point) - gbuffer.camera.eye)


@dataclass(eq=False)
class GBuffer:
    """What a camera sees, row by row; positions and normals are made when they are asked for."""

    scene: DeviceScene
    camera: Camera
    view: GBufferView
    """Object, triangle and barycentrics of (height * width) pixels, and the camera."""

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
        mirrors = np.array([entry.source.is_reflector for entry in self.scene.objects] + [False])
        return mirrors[self.objects]  # -1 picks the last, False

    @functools.cached_property
    def surfaces(self) -> tuple[wp.array, wp.array]:
        """Positions and shading normals of all pixels in device space, (h * w,) vec3 each."""
        device = self.scene.device
        position = wp.zeros(self.pixel_count, dtype=wp.vec3, device=device)
        normal = wp.zeros(self.pixel_count, dtype=wp.vec3, device=device)
        launch.launch(find_surfaces, self.pixel_count, [self.view, self.scene.records, position, normal], device)
        return position, normal


def draw_gbuffer(scene: DeviceScene, camera: Camera, *, without: int = -1) -> GBuffer:
    """What ``camera`` sees of the scene, object number ``without`` left out."""
    device, width, height = scene.device, camera.width, camera.height
    pixels = width * height
    keys = wp.zeros(pixels, dtype=wp.int64, device=device)
    first_vertices = np.cumsum([0] + [len(entry.geometry.vertices) for entry in scene.objects]).tolist()
    corners = wp.empty(first_vertices[-1], dtype=wp.vec3d, device=device)
    from_world = pixels_from_world(camera)
    for entry, first_vertex in zip(scene.objects, first_vertices, strict=False):
        if entry.index == without:
            continue
        mesh, rows = entry.geometry, [wp.vec4d(*row) for row in from_world @ entry.world_from_unit]
        launch.launch(project_vertices, len(mesh.vertices), [mesh.vertices, *rows, first_vertex, corners], device)
        # Most triangles of a dense mesh lie between pixel centres: find the others once, for all threads.
        triangles = len(mesh.faces)
        projected = ProjectedMesh()
        projected.faces, projected.corners = mesh.faces, corners
        projected.first_vertex, projected.first_triangle = first_vertex, entry.record.first_triangle
        projected.width, projected.height = width, height
        marked = wp.zeros(triangles + 1, dtype=wp.int32, device=device)
        boxes = wp.empty(triangles, dtype=PixelBox, device=device)
        launch.launch(find_visible, triangles, [projected, marked, boxes], device)
        visible = list_items(marked)
        launch.launch_parts(draw_triangles, visible.shape[0], [projected, visible, boxes, keys], device)
    view = GBufferView()
    view.object, view.triangle = (wp.empty(pixels, dtype=wp.int32, device=device) for _ in range(2))
    view.barycentrics = wp.zeros(pixels, dtype=wp.vec2, device=device)
    view.camera = camera_view(camera, scene.device_from_world)
    if scene.objects:
        firsts = wp.array([entry.record.first_triangle for entry in scene.objects], dtype=wp.int32, device=device)
        starts = wp.array(first_vertices[:-1], dtype=wp.int32, device=device)
        inputs = [keys, firsts, starts, scene.records, corners, width, view.object, view.triangle, view.barycentrics]
        launch.launch(resolve_pixels, pixels, inputs, device)
    else:
        view.object.fill_(-1)
        view.triangle.fill_(-1)
    return GBuffer(scene, camera, view)
