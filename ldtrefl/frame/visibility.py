"""Primary visibility: which point of which triangle each pixel sees.

It is found by a z-buffer (``zbuffer.py``). Triangles are drawn into it; in meshes whose triangles are many and small a
method may have the pixels' rays searched for instead (``search_choice.py``), if it needs a tree over them anyway: to
build one costs more than to draw once. ``tools/gbuffer_choice.py`` measures both. A large image is made in bands.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.gbuffer import GBuffer, GBufferView, ray_through
from ldtrefl.frame.pixel_box import BEHIND
from ldtrefl.frame.pixel_order import BLOCK
from ldtrefl.frame.projection import DrawnObject, corner_of, homogeneous
from ldtrefl.frame.searched_pixels import CameraSearch, numbers_of
from ldtrefl.frame.zbuffer import CornerRoom, Drawing
from ldtrefl.geometry.perspective_raster import (
    HomogeneousTriangle,
    homogeneous_triangle,
    inverse_depth,
    perspective_weights,
)
from ldtrefl.geometry.vectors import as_single
from ldtrefl.scene.description import Camera
from ldtrefl.shading.surface import may_see_back, part_of
from ldtrefl.world.camera import Band, camera_view, whole_image
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.triangle_numbers import TriangleNumbers, first_triangle_of, has_number, object_of

BAND_PIXELS = 1 << 20
"""Pixels of a band, about: enough rays for all threads, and their arrays take less than 0.2 GB."""


PIXELS_IN_A_ROW = 64
"""Pixels that one thread of a CPU finds: neighbours often see the same object."""


@wp.func
def number_in(key: wp.int64) -> int:
    """The number that leads back to a triangle."""
    return int(key & wp.int64(0x7FFFFFFF))


@wp.func
def pixel_of(i: int, width: int, first_row: int) -> wp.vec2d:
    """The centre of pixel ``i`` of a band, in the whole image."""
    half = wp.float64(0.5)
    return wp.vec2d(wp.float64(i % width) + half, wp.float64(first_row + i / width) + half)


@wp.func
def triangle_seen(
    drawn: DrawnObject, objects: wp.array(dtype=ObjectRecord), corners: wp.array(dtype=wp.vec3d), triangle: int
) -> HomogeneousTriangle:
    """A triangle of an object that is drawn."""
    face = objects[drawn.object].faces[triangle]
    return homogeneous_triangle(
        homogeneous(corner_of(drawn, objects, corners, face[0])),
        homogeneous(corner_of(drawn, objects, corners, face[1])),
        homogeneous(corner_of(drawn, objects, corners, face[2])),
    )


@wp.func
def of_its_group(
    drawn: DrawnObject,
    objects: wp.array(dtype=ObjectRecord),
    corners: wp.array(dtype=wp.vec3d),
    first_triangle: int,
    count: int,
    pixel: wp.vec2d,
    key: wp.int64,
) -> int:
    """The triangle of a group that a pixel of this key sees; the last one of several."""
    nearness = wp.cast(int(key >> wp.int64(32)), float)
    found, best = int(first_triangle), float(wp.inf)
    for triangle in range(first_triangle, wp.min(first_triangle + count, objects[drawn.object].faces.shape[0])):
        tri = triangle_seen(drawn, objects, corners, triangle)
        at = perspective_weights(tri, pixel[0], pixel[1])
        if wp.min(at) >= BEHIND and tri.volume != BEHIND:
            # The same arithmetic drew it, but for triangles near the camera's plane, or by another rounding.
            off = wp.abs(inverse_depth(tri, at) - nearness)
            if off <= best:
                best = off
                found = triangle
    return found


@wp.func
def leads_on(objects: wp.array(dtype=ObjectRecord), looks: Looks, gbuffer: GBufferView, i: int, reflects: int) -> int:
    """1 if a ray may go on, mirrored or straight, from what a pixel sees of an object that ``reflects`` so, else 0."""
    if reflects != 2:
        return reflects
    index, triangle = gbuffer.object[i], gbuffer.triangle[i]
    look, part = objects[index].look, part_of(objects, index, triangle)
    if looks.records[look].materials[part].hides_back != 0:
        if may_see_back(objects[index], triangle, as_single(wp.normalize(ray_through(gbuffer, i)))):
            return 1
    return looks.records[look].materials[part].reflects


@launch.kernel
def resolve_pixels(
    first: int,
    # In:
    keys: wp.array(dtype=wp.int64),
    objects: wp.array(dtype=ObjectRecord),
    drawn: wp.array(dtype=DrawnObject),
    place_of: wp.array(dtype=wp.int32),  # of each object of the scene among those drawn
    numbers: TriangleNumbers,
    corners: wp.array(dtype=wp.vec3d),
    width: int,
    first_row: int,
    run: int,
    looks: Looks,
    # Out, the reflectors 0 before:
    seen: GBufferView,
):
    """Find which triangle each pixel of a run sees, from its key."""
    i = run * (first + wp.tid())
    end = wp.min(i + run, keys.shape[0])
    index = int(-1)
    reflects = int(0)
    while i < end:
        key = keys[i]
        if key == wp.int64(0):
            seen.object[i] = -1
        else:
            number = number_in(key)
            if not has_number(numbers, index, number):
                index = object_of(numbers, number)
                reflects = objects[index].reflects
            triangle = first_triangle_of(numbers, index, number)
            if numbers.shift > 0:
                one, pixel = drawn[place_of[index]], pixel_of(i, width, first_row)
                triangle = of_its_group(one, objects, corners, triangle, 1 << numbers.shift, pixel, key)
            seen.object[i] = index
            seen.triangle[i] = triangle
            is_mirror = leads_on(objects, looks, seen, i, reflects)
            seen.reflector[i] = wp.where(is_mirror != 0, wp.uint8(1), wp.uint8(0))
        i += 1


def resolved(drawing: Drawing, scene: DeviceScene) -> GBuffer:
    """The G-buffer of what was drawn: which triangle each pixel sees."""
    device, camera, pixels = scene.device, drawing.camera, drawing.keys.shape[0]
    view = GBufferView()
    view.object, view.triangle = (wp.empty(pixels, dtype=wp.int32, device=device) for _ in range(2))
    view.reflector = wp.zeros(pixels, dtype=wp.uint8, device=device)
    view.camera = camera_view(camera, scene.device_from_world, drawing.band, scene.samples)
    drawn, places = _drawn_by_object(drawing, scene)
    run = PIXELS_IN_A_ROW if device.is_cpu else 1
    inputs = [
        drawing.keys,
        scene.records,
        drawn,
        places,
        scene.triangle_numbers,
        drawing.room.corners,
        camera.width,
        drawing.band.first_row,
        run,
        scene.looks,
        view,
    ]
    launch.launch(resolve_pixels, -(-pixels // run), inputs, device)
    return GBuffer(scene, camera, view, drawing.band)


def _drawn_by_object(drawing: Drawing, scene: DeviceScene) -> tuple[wp.array, wp.array]:
    """What was drawn, (n,) ``DrawnObject``, and (objects,) int32 the place there of each object of the scene, -1 of
    others. Both are empty where a number tells a triangle by itself: nothing of them is read."""
    device = scene.device
    if scene.triangle_numbers.shift == 0:
        return wp.empty(0, dtype=DrawnObject, device=device), wp.empty(0, dtype=wp.int32, device=device)
    objects = DrawnObjects.joined([part.objects for part in drawing.drawn])
    drawn = objects.on_device(np.concatenate([part.first_corners for part in drawing.drawn]), device)
    place_of = np.full(len(scene.objects), -1, np.int32)
    place_of[objects.numbers] = np.arange(len(objects.numbers))
    return drawn, wp.array(place_of, dtype=wp.int32, device=device)


def draw_gbuffer(scene: DeviceScene, camera: Camera, search: CameraSearch | None = None) -> GBuffer:
    """Draw what ``camera`` sees of the scene; its rays are searched for in those objects that ``search`` has."""
    drawing = Drawing(camera, whole_image(camera), CornerRoom.of(scene, numbers_of(search)))
    drawing.draw(scene, DrawnObjects.of(scene, camera, np.arange(len(scene.objects))), search)
    return resolved(drawing, scene)


def draw_in_bands(
    scene: DeviceScene, camera: Camera, search: CameraSearch | None = None, *, without: int = -1, beyond: int = 0
) -> Iterator[GBuffer]:
    """The same, band by band from the top; object number ``without`` is left out. Each band goes on for ``beyond`` rows
    above and below, if the image does."""
    everything = np.arange(len(scene.objects))
    objects = DrawnObjects.of(scene, camera, everything[everything != without])
    rows = max(1, BAND_PIXELS // camera.width // BLOCK) * BLOCK
    room = CornerRoom.of(scene, numbers_of(search))
    for row in range(0, camera.height, rows):
        top, bottom = max(0, row - beyond), min(camera.height, row + rows + beyond)
        drawing = Drawing(camera, Band(top, bottom - top), room)
        # Corners are the whole image's: those that are kept are found once.
        drawing.draw(scene, objects, search, are_projected=row > 0 and room.keeps)
        yield resolved(drawing, scene)
