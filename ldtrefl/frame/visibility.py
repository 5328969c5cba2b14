"""Primary visibility: which point of which triangle each pixel sees.

It is found by a z-buffer (``zbuffer.py``). To cast rays instead would need a BVH, whose build alone costs more than
drawing once; ``tools/gbuffer_choice.py`` measures both. A large image is made in bands.
"""

from __future__ import annotations

from collections.abc import Iterator

import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.gbuffer import GBuffer, GBufferView
from ldtrefl.frame.pixel_order import BLOCK
from ldtrefl.frame.projection import homogeneous
from ldtrefl.frame.zbuffer import Drawing, empty_corners, object_of, project
from ldtrefl.geometry.perspective_raster import homogeneous_triangle, perspective_weights
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import Band, camera_view
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord

BAND_PIXELS = 1 << 20
"""Pixels of a band, about: enough rays for all threads, and their arrays take less than 0.2 GB."""


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
    """Find which point of which triangle one pixel sees, from its key."""
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


def resolved(drawing: Drawing, scene: DeviceScene, camera: Camera) -> GBuffer:
    """The G-buffer of what was drawn: which point of which triangle each pixel sees."""
    device, pixels = scene.device, camera.width * drawing.band.rows
    view = GBufferView()
    view.object, view.triangle = (wp.empty(pixels, dtype=wp.int32, device=device) for _ in range(2))
    view.barycentrics = wp.empty(pixels, dtype=wp.vec2, device=device)
    view.reflector = wp.zeros(pixels, dtype=wp.uint8, device=device)
    view.camera = camera_view(camera, scene.device_from_world, drawing.band)
    inputs = [drawing.keys, scene.records, drawing.corners, camera.width, drawing.band.first_row]
    outputs = [view.object, view.triangle, view.barycentrics, view.reflector]
    launch.launch(resolve_pixels, pixels, [*inputs, *outputs], device)
    return GBuffer(scene, camera, view, drawing.band)


def draw_gbuffer(scene: DeviceScene, camera: Camera) -> GBuffer:
    """Draw what ``camera`` sees of the scene."""
    drawing = Drawing.empty(scene, camera)
    drawing.add(scene, camera, range(len(scene.objects)))
    return resolved(drawing, scene, camera)


def draw_in_bands(scene: DeviceScene, camera: Camera, *, without: int = -1) -> Iterator[GBuffer]:
    """Draw what ``camera`` sees of the scene, band by band from the top; object number ``without`` is left out."""
    everything = [number for number in range(len(scene.objects)) if number != without]
    rows = max(1, BAND_PIXELS // camera.width // BLOCK) * BLOCK
    # The corners are the whole image's, and found once.
    corners = empty_corners(scene)
    project(scene, camera, everything, corners)
    for row in range(0, camera.height, rows):
        band = Band(row, min(rows, camera.height - row))
        drawing = Drawing.empty(scene, camera, band, corners)
        drawing.draw(scene, camera, everything)
        yield resolved(drawing, scene, camera)
