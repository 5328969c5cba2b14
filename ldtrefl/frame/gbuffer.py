"""The G-buffer: what each pixel of the camera's image sees, and the surface there."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit
from ldtrefl.frame.pixel_order import pixels_in_blocks
from ldtrefl.scene.description import Camera
from ldtrefl.shading.surface import Surface
from ldtrefl.shading.surfaces import GROUP, Sighting, look_from
from ldtrefl.tracing.tracer import block_of
from ldtrefl.world.camera import Band, CameraView, camera_ray, pixel_place
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord

PLACES = wp.constant(wp.float64(64.0))
"""Of a pixel along each axis, that points are told apart by."""

STRIDE = wp.constant(wp.vec2i(17, 29))
"""Pixels between the patterns of points that are a place apart."""


@wp.struct
class GBufferView:
    """What kernels read of a G-buffer."""

    object: wp.array(dtype=wp.int32)  # -1 where nothing is seen
    triangle: wp.array(dtype=wp.int32)  # set only where something is seen
    reflector: wp.array(dtype=wp.uint8)  # 1 where a reflector is seen
    camera: CameraView
    place: wp.array(dtype=wp.vec2d)  # points of the image that are seen in place of its pixels; empty: the pixels


@wp.func
def pixel_ray(camera: CameraView, pixel: int) -> wp.vec3d:
    """Direction through a pixel's centre."""
    row = pixel / camera.width
    half = wp.float64(0.5)
    return camera_ray(camera, wp.float64(pixel - row * camera.width) + half, wp.float64(row) + half)


@wp.func
def ray_through(gbuffer: GBufferView, i: int) -> wp.vec3d:
    """Direction through the centre of pixel ``i``, or through point ``i`` if these are seen in place of pixels."""
    if gbuffer.place.shape[0] == 0:
        return pixel_ray(gbuffer.camera, i)
    return camera_ray(gbuffer.camera, gbuffer.place[i][0], gbuffer.place[i][1])


@wp.func
def pattern_place(gbuffer: GBufferView, i: int) -> wp.vec2i:
    """Where what pixel or point ``i`` sees takes its patterns of samples from: the pixel in the whole image, and for
    points of a pixel places far from one another, so that their grain is not the same."""
    if gbuffer.place.shape[0] == 0:
        return pixel_place(gbuffer.camera, i)
    at = gbuffer.place[i]
    column, row = wp.floor(at[0]), wp.floor(at[1]) + wp.float64(gbuffer.camera.first_row)
    within = wp.vec2d(at[0] - wp.floor(at[0]), at[1] - wp.floor(at[1]))
    # To multiples of 1/64 of a pixel: rows of a band may be told by other numbers, which round in other ways.
    right, down = wp.rint(PLACES * within[0]), wp.rint(PLACES * within[1])
    return wp.vec2i(int(column) + STRIDE[0] * int(right), int(row) + STRIDE[1] * int(down))


@wp.func
def sight(gbuffer: GBufferView, pixel: int, sightings: wp.array(dtype=Sighting), lane: int):
    """Let a lane of a group see what a pixel sees."""
    sightings[lane].object = gbuffer.object[pixel]
    sightings[lane].triangle = gbuffer.triangle[pixel]
    sightings[lane].way = ray_through(gbuffer, pixel)


@wp.func
def sight_group(gbuffer: GBufferView, begin: int, end: int, sightings: wp.array(dtype=Sighting)) -> int:
    """Let the lanes of a group see what pixels from ``begin`` on see; those that see something, a bit each."""
    lanes = int(0)
    for i in range(begin, wp.min(begin + GROUP, end)):
        if gbuffer.object[i] >= 0:
            sight(gbuffer, i, sightings, i - begin)
            lanes = lanes | (1 << (i - begin))
    return lanes


@launch.kernel
def find_surfaces(
    first: int,
    # In:
    block: int,
    gbuffer: GBufferView,
    objects: wp.array(dtype=ObjectRecord),
    # Out:
    position_out: wp.array(dtype=wp.vec3d),
    normal_out: wp.array(dtype=wp.vec3),
):
    """Find where the surfaces of a block of pixels lie, and their shading normals."""
    sight_memory, surface_memory = wp.zeros(shape=GROUP, dtype=Sighting), wp.zeros(shape=GROUP, dtype=Surface)
    sightings = wp.array(ptr=sight_memory.ptr, shape=(GROUP,), dtype=Sighting)
    surfaces = wp.array(ptr=surface_memory.ptr, shape=(GROUP,), dtype=Surface)
    begin = block * (first + wp.tid())
    end = wp.min(begin + block, position_out.shape[0])
    while begin < end:
        lanes = sight_group(gbuffer, begin, end, sightings)
        look_from(objects, lanes, gbuffer.camera.eye, sightings, surfaces)
        while lanes != 0:
            lane = lowest_bit(wp.uint64(lanes))
            lanes = lanes & (lanes - 1)
            position_out[begin + lane] = surfaces[lane].position
            normal_out[begin + lane] = surfaces[lane].normal
        begin += GROUP


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
        return np.where(self.objects < 0, -1, self.view.triangle.numpy().reshape(self.shape))

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
        block = block_of(device)
        inputs = [block, self.view, self.scene.records, position, normal]
        launch.launch(find_surfaces, -(-self.pixel_count // block), inputs, device)
        return position, normal
