"""Primary visibility: which point of which triangle each pixel sees.

A z-buffer over homogeneous triangles (``zbuffer.py``). Against casting rays through a BVH it needs no BVH, whose build
alone costs more than drawing once; ``tools/gbuffer_choice.py`` measures both. A large image is made in bands.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.zbuffer import Drawing, homogeneous, object_of
from ldtrefl.geometry.perspective_raster import homogeneous_triangle, perspective_weights
from ldtrefl.geometry.vectors import as_double, from_to
from ldtrefl.scene.description import Camera
from ldtrefl.shading.shade import Surface, surface_at
from ldtrefl.world.camera import Band, CameraView, camera_ray, camera_view
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.unit_rays import unit_vertex

BAND_PIXELS = 1 << 20
"""Pixels of a band, about: enough rays for all threads, and their arrays take less than 0.2 GB."""

BLOCK = 8
"""Pixels along a side of the blocks in which reflected rays stand; a band is a whole number of them high."""


LARGE_OBJECT = wp.constant(64.0)
"""Radii of an object in distances from the eye from which what a pixel sees of it is taken from the pixel's ray: the
rounding of barycentrics is then a hundred-thousandth of the distance, a hundredth of a pixel."""


@wp.struct
class GBufferView:
    """What kernels read of a G-buffer."""

    object: wp.array(dtype=wp.int32)  # -1 where nothing is seen
    triangle: wp.array(dtype=wp.int32)
    barycentrics: wp.array(dtype=wp.vec2)  # weights of the second and third corner
    reflector: wp.array(dtype=wp.uint8)  # 1 where a reflector is seen
    camera: CameraView


@launch.kernel
def resolve_pixels(
    first: int,
    # In:
    keys: wp.array(dtype=wp.int64),
    objects: wp.array(dtype=ObjectRecord),
    corners: wp.array(dtype=wp.vec3d),
    width: int,
    first_row: int,
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
    x, y = wp.float64(i % width) + wp.float64(0.5), wp.float64(first_row + i / width) + wp.float64(0.5)
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


@wp.struct
class PixelView:
    """The line of sight of a pixel."""

    direction: wp.vec3  # from the eye to what the pixel sees, unit; 0 if the eye touches it
    is_close_to_large: bool  # the object is so large for its distance that barycentrics do not tell where it is seen


@wp.func
def pixel_view(gbuffer: GBufferView, objects: wp.array(dtype=ObjectRecord), pixel: int) -> PixelView:
    """How a pixel sees what it sees."""
    index = gbuffer.object[pixel]
    corners = objects[index].faces[gbuffer.triangle[pixel]]
    u, v = gbuffer.barycentrics[pixel][0], gbuffer.barycentrics[pixel][1]
    point = (
        (1.0 - u - v) * objects[index].vertices[corners[0]]
        + u * objects[index].vertices[corners[1]]
        + v * objects[index].vertices[corners[2]]
    )
    position = wp.transform_point(objects[index].device_from_unit, as_double(point))
    offset = from_to(gbuffer.camera.eye, position)
    distance = wp.length(offset)
    view = PixelView()
    view.is_close_to_large = objects[index].radius > LARGE_OBJECT * distance
    if view.is_close_to_large:
        offset = pixel_ray(gbuffer, pixel)
        distance = wp.length(offset)
    if distance > 0.0:
        view.direction = offset / distance
    return view


@wp.func
def pixel_ray(gbuffer: GBufferView, pixel: int) -> wp.vec3:
    """Direction through a pixel's centre."""
    width = gbuffer.camera.width
    return camera_ray(gbuffer.camera, float(pixel % width) + 0.5, float(pixel / width) + 0.5)


@wp.func
def exact_corner(record: ObjectRecord, vertex: int) -> wp.vec3d:
    """A vertex in device space."""
    return wp.transform_point(record.device_from_unit, unit_vertex(record, vertex))


@wp.func
def point_on_ray(record: ObjectRecord, triangle: int, eye: wp.vec3d, ray: wp.vec3, otherwise: wp.vec3d) -> wp.vec3d:
    """Where a ray from the eye meets the plane of a triangle, in float64; ``otherwise`` where it does not."""
    corners = record.faces[triangle]
    a = exact_corner(record, corners[0])
    normal = wp.cross(exact_corner(record, corners[1]) - a, exact_corner(record, corners[2]) - a)
    way = as_double(ray)
    slope = wp.dot(normal, way)
    if slope == wp.float64(0.0):
        return otherwise
    return eye + (wp.dot(normal, a - eye) / slope) * way


@wp.func
def pixel_surface(gbuffer: GBufferView, objects: wp.array(dtype=ObjectRecord), pixel: int, view: PixelView) -> Surface:
    """The surface that the pixel sees."""
    uv = gbuffer.barycentrics[pixel]
    index, triangle, eye = gbuffer.object[pixel], gbuffer.triangle[pixel], gbuffer.camera.eye
    surface = surface_at(objects, index, triangle, uv[0], uv[1], view.direction)
    if view.is_close_to_large:
        ray = pixel_ray(gbuffer, pixel)
        surface.position = point_on_ray(objects[index], triangle, eye, ray, surface.position)
    return surface


@dataclass(frozen=True, eq=False)
class GBuffer:
    """What a camera sees in a band of its image, row by row.

    The pictures are the caller's own copies, made when they are asked for; so are positions and normals.
    """

    scene: DeviceScene
    camera: Camera
    view: GBufferView
    """Of (height * width) pixels what each sees, and the camera."""
    band: Band
    """The rows; h is their number."""

    @property
    def shape(self) -> tuple[int, int]:
        """(h, w) of the band."""
        return self.band.rows, self.camera.width

    @property
    def is_whole(self) -> bool:
        """Whether the band is the whole image."""
        return self.band.rows == self.camera.height

    @property
    def pixel_count(self) -> int:
        """Pixels of the band."""
        return self.band.rows * self.camera.width

    @functools.cached_property
    def objects(self) -> np.ndarray:
        """(h, w) int32 object numbers, -1 where nothing is seen."""
        return self._copied(self.view.object)

    @functools.cached_property
    def triangles(self) -> np.ndarray:
        """(h, w) int32 triangle numbers within the object, -1 where nothing is seen."""
        return self._copied(self.view.triangle)

    @functools.cached_property
    def reflector_mask(self) -> np.ndarray:
        """(h, w) bool: pixels that see a reflector."""
        return self._copied(self.view.reflector).view(bool)

    def _copied(self, values: wp.array) -> np.ndarray:
        # On the CPU ``numpy`` gives the device's own memory.
        return np.array(values.numpy()).reshape(self.shape)

    @functools.cached_property
    def surfaces(self) -> tuple[wp.array, wp.array]:
        """Positions, (h * w,) vec3d, and shading normals, (h * w,) vec3, of all pixels in device space."""
        device = self.scene.device
        position = wp.zeros(self.pixel_count, dtype=wp.vec3d, device=device)
        normal = wp.zeros(self.pixel_count, dtype=wp.vec3, device=device)
        launch.launch(find_surfaces, self.pixel_count, [self.view, self.scene.records, position, normal], device)
        return position, normal


def resolved(drawing: Drawing, scene: DeviceScene, camera: Camera) -> GBuffer:
    """What each pixel sees."""
    device, pixels = scene.device, camera.width * drawing.band.rows
    view = GBufferView()
    view.object, view.triangle = (wp.empty(pixels, dtype=wp.int32, device=device) for _ in range(2))
    view.barycentrics = wp.empty(pixels, dtype=wp.vec2, device=device)
    view.reflector = wp.zeros(pixels, dtype=wp.uint8, device=device)
    view.camera = camera_view(camera, scene.device_from_world, drawing.band)
    if scene.objects:
        inputs = [drawing.keys, scene.records, drawing.corners, camera.width, drawing.band.first_row]
        outputs = [view.object, view.triangle, view.barycentrics, view.reflector]
        launch.launch(resolve_pixels, pixels, [*inputs, *outputs], device)
    else:
        view.object.fill_(-1)
        view.triangle.fill_(-1)
    return GBuffer(scene, camera, view, drawing.band)


def draw_gbuffer(scene: DeviceScene, camera: Camera) -> GBuffer:
    """What ``camera`` sees of the scene."""
    drawing = Drawing.empty(scene, camera)
    drawing.add(scene, camera, range(len(scene.objects)))
    return resolved(drawing, scene, camera)


def draw_in_bands(scene: DeviceScene, camera: Camera, *, without: int = -1) -> Iterator[GBuffer]:
    """What ``camera`` sees of the scene, band by band from the top, object number ``without`` left out."""
    everything = [number for number in range(len(scene.objects)) if number != without]
    rows = max(1, BAND_PIXELS // camera.width // BLOCK) * BLOCK
    # The corners are the whole image's, and found once.
    first = Drawing.empty(scene, camera, Band(0, min(rows, camera.height)))
    first.project(scene, camera, everything)
    for row in range(0, camera.height, rows):
        band = Band(row, min(rows, camera.height - row))
        drawing = first.of_band(scene, camera, band)
        drawing.draw(scene, camera, everything)
        yield resolved(drawing, scene, camera)
