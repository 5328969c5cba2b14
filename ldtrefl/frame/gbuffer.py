"""The G-buffer: what each pixel of the camera's image sees, and the surface there."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.pixel_order import pixels_in_blocks
from ldtrefl.geometry.vectors import as_double, from_to
from ldtrefl.scene.description import Camera
from ldtrefl.shading.surface import Surface, surface_at
from ldtrefl.world.camera import Band, CameraView, camera_ray
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.unit_rays import unit_vertex

LARGE_OBJECT = wp.constant(64.0)
"""Where an object's radius is more than this many times its distance from the eye, the point that a pixel sees is found
on the pixel's ray. Barycentrics are then rounded by a hundred-thousandth of the distance, a hundredth of a pixel."""


@wp.struct
class GBufferView:
    """What kernels read of a G-buffer."""

    object: wp.array(dtype=wp.int32)  # -1 where nothing is seen
    triangle: wp.array(dtype=wp.int32)
    barycentrics: wp.array(dtype=wp.vec2)  # weights of the second and third corner
    reflector: wp.array(dtype=wp.uint8)  # 1 where a reflector is seen
    camera: CameraView


@wp.struct
class PixelView:
    """The line of sight of a pixel."""

    direction: wp.vec3  # from the eye to what the pixel sees, unit; 0 if the eye touches it
    is_close_to_large: bool  # the object is so large for its distance that barycentrics do not tell where it is seen


@wp.func
def pixel_view(gbuffer: GBufferView, objects: wp.array(dtype=ObjectRecord), pixel: int) -> PixelView:
    """The line of sight of a pixel that sees an object."""
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
    """Where a ray from the eye meets the plane of a triangle, in float64; ``otherwise`` if it runs along the plane."""
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
    """Find where the surface of one pixel lies, and its shading normal."""
    i = first + wp.tid()
    if gbuffer.object[i] >= 0:
        surface = pixel_surface(gbuffer, objects, i, pixel_view(gbuffer, objects, i))
        position_out[i] = surface.position
        normal_out[i] = surface.normal


@dataclass(frozen=True, eq=False)
class GBuffer:
    """What a camera sees in a band of its image, row by row.

    The pictures are the caller's own copies, made when they are asked for; so are positions and normals.
    """

    scene: DeviceScene
    camera: Camera
    view: GBufferView
    """What each of (height * width) pixels sees, and the camera."""
    band: Band
    """The rows; h is their number."""

    @property
    def shape(self) -> tuple[int, int]:
        """(h, w) of the band."""
        return self.band.rows, self.camera.width

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

    @functools.cached_property
    def reflector_pixels(self) -> wp.array:
        """(m,) int32: the pixels that see a reflector, block by block (``pixel_order.py``)."""
        return wp.array(pixels_in_blocks(self.reflector_mask), dtype=wp.int32, device=self.scene.device)

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
