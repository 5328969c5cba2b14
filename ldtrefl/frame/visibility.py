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
from ldtrefl.frame.fetch_ahead import fetch_triangles, number_in
from ldtrefl.frame.gbuffer import GBuffer, GBufferView
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
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import Band, camera_view, whole_image
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.triangle_numbers import TriangleNumbers, first_triangle_of, object_of

BAND_PIXELS = 1 << 20
"""Pixels of a band, about: enough rays for all threads, and their arrays take less than 0.2 GB."""


PIXELS_IN_A_ROW = 16
"""Pixels that one thread of a CPU finds: neighbours often see the same triangle, which is then projected once."""

UNCACHED = 1 << 20
"""Triangles of a scene from which caches do not hold them, and those that pixels see are asked of memory together
(``fetch_ahead.py``). What caches hold comes sooner without that."""


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
def weights_inside(at: wp.vec3d) -> wp.vec3d:
    """Weights of a triangle's corners that none is negative of: those of a pixel beside a triangle that was found to be
    seen there by a search, which rounds to float32. A triangle that is seen edge on is seen in its middle."""
    zero, one = wp.float64(0.0), wp.float64(1.0)
    inside = wp.vec3d(
        wp.where(at[0] > zero, at[0], zero), wp.where(at[1] > zero, at[1], zero), wp.where(at[2] > zero, at[2], zero)
    )
    if inside[0] + inside[1] + inside[2] == zero:
        return wp.vec3d(one, one, one)
    return inside


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
    fetches: int,  # 1 to ask for the triangles of a run together
    # Out, the reflectors 0 before:
    seen: GBufferView,
):
    """Find which point of which triangle each pixel of a run sees, from its key."""
    begin = run * (first + wp.tid())
    end = wp.min(begin + run, keys.shape[0])
    if fetches == 1:
        fetch_triangles(keys, begin, end, objects, drawn, place_of, numbers, corners)
    i = int(begin)
    while i < end:
        if keys[i] == wp.int64(0):
            seen.object[i] = -1
            seen.triangle[i] = -1
            seen.barycentrics[i] = wp.vec2(0.0, 0.0)
            i += 1
        else:
            number = number_in(keys[i])
            index = object_of(numbers, number)
            one = drawn[place_of[index]]
            triangle = first_triangle_of(numbers, index, number)
            if numbers.shift > 0:
                pixel = pixel_of(i, width, first_row)
                triangle = of_its_group(one, objects, corners, triangle, 1 << numbers.shift, pixel, keys[i])
            tri = triangle_seen(one, objects, corners, triangle)
            is_mirror = wp.where(wp.max(objects[index].mirror) > 0.0, wp.uint8(1), wp.uint8(0))

            # Pixels in a row often see the same triangle.
            more = bool(True)
            while more:
                pixel = pixel_of(i, width, first_row)
                at = weights_inside(perspective_weights(tri, pixel[0], pixel[1]))
                total = at[0] + at[1] + at[2]
                seen.object[i] = index
                seen.triangle[i] = triangle
                seen.barycentrics[i] = wp.vec2(float(at[1] / total), float(at[2] / total))
                seen.reflector[i] = is_mirror
                i += 1
                more = i < end and numbers.shift == 0
                if more:
                    more = number_in(keys[i]) == number and keys[i] != wp.int64(0)


def resolved(drawing: Drawing, scene: DeviceScene) -> GBuffer:
    """The G-buffer of what was drawn: which point of which triangle each pixel sees."""
    device, camera, pixels = scene.device, drawing.camera, drawing.keys.shape[0]
    view = GBufferView()
    view.object, view.triangle = (wp.empty(pixels, dtype=wp.int32, device=device) for _ in range(2))
    view.barycentrics = wp.empty(pixels, dtype=wp.vec2, device=device)
    view.reflector = wp.zeros(pixels, dtype=wp.uint8, device=device)
    view.camera = camera_view(camera, scene.device_from_world, drawing.band)
    objects = DrawnObjects.joined([part.objects for part in drawing.drawn])
    drawn = drawing.drawn[0].drawn if len(drawing.drawn) == 1 else None
    if drawn is None:
        drawn = objects.on_device(np.concatenate([part.first_corners for part in drawing.drawn]), device)
    place_of = np.full(len(scene.objects), -1, np.int32)
    place_of[objects.numbers] = np.arange(len(objects.numbers))
    places = wp.array(place_of, dtype=wp.int32, device=device)
    run = PIXELS_IN_A_ROW if device.is_cpu else 1
    known = [scene.records, drawn, places, scene.triangle_numbers]
    inputs = [drawing.keys, *known, drawing.room.corners, camera.width, drawing.band.first_row, run]
    inputs += [int(device.is_cpu and scene.triangle_counts.sum() >= UNCACHED), view]
    launch.launch(resolve_pixels, -(-pixels // run), inputs, device)
    return GBuffer(scene, camera, view, drawing.band)


def draw_gbuffer(scene: DeviceScene, camera: Camera, search: CameraSearch | None = None) -> GBuffer:
    """Draw what ``camera`` sees of the scene; its rays are searched for in those objects that ``search`` has."""
    drawing = Drawing(camera, whole_image(camera), CornerRoom.of(scene, numbers_of(search)))
    drawing.draw(scene, DrawnObjects.of(scene, camera, np.arange(len(scene.objects))), search)
    return resolved(drawing, scene)


def draw_in_bands(
    scene: DeviceScene, camera: Camera, search: CameraSearch | None = None, *, without: int = -1
) -> Iterator[GBuffer]:
    """The same, band by band from the top; object number ``without`` is left out."""
    everything = np.arange(len(scene.objects))
    objects = DrawnObjects.of(scene, camera, everything[everything != without])
    rows = max(1, BAND_PIXELS // camera.width // BLOCK) * BLOCK
    room = CornerRoom.of(scene, numbers_of(search))
    for row in range(0, camera.height, rows):
        drawing = Drawing(camera, Band(row, min(rows, camera.height - row)), room)
        # Corners are the whole image's: those that are kept are found once.
        drawing.draw(scene, objects, search, are_projected=row > 0 and room.keeps)
        yield resolved(drawing, scene)
