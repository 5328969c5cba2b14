"""The z-buffer: which triangle is nearest in each pixel, and how near.

All objects are drawn by the same three launches, however many there are: their vertices and triangles are handed out in
chunks. The triangles are those of ``geometry/perspective_raster.py``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.atomics import take_place
from ldtrefl.device.bins import CHUNK
from ldtrefl.frame.projection import Chunks, chunks_of, project_vertices
from ldtrefl.frame.triangle_rows import draw_rows, object_triangles, triangle_box
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import Band, pixels_from_world, whole_image
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord

LARGE_BOX = wp.constant(4096)
"""Pixels in a triangle's box from which it is drawn in strips of rows, so that all threads share it."""

STRIP = wp.constant(8)
"""Rows of such a strip."""


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
    """Draw the triangles of one chunk, but list those whose boxes are large."""
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
    """Draw one strip of rows of a large triangle."""
    i = first + wp.tid()
    strips = (end_row - first_row + STRIP - 1) / STRIP
    number = large[i / strips]
    index = object_of(objects, number)
    mesh = object_triangles(objects, index, corners, width, first_row, end_row)
    triangle = number - mesh.first_triangle
    box = triangle_box(mesh, triangle)
    strip = first_row + STRIP * (i % strips)
    draw_rows(mesh, triangle, box, wp.max(box.first_y, strip), wp.min(box.last_y, strip + STRIP - 1), key_out)


def empty_corners(scene: DeviceScene) -> wp.array:
    """(all objects' vertices,) vec3d, not filled yet."""
    return wp.empty(int(scene.vertex_counts.sum()), dtype=wp.vec3d, device=scene.device)


def project(scene: DeviceScene, camera: Camera, numbers: Sequence[int], corners: wp.array) -> None:
    """Find the corners, in pixels of the whole image, of the objects of these numbers."""
    if not len(numbers):
        return
    listed, device = np.array(numbers), scene.device
    rows = (pixels_from_world(camera) @ scene.world_from_unit[listed]).reshape(-1, 4)
    chunks, count = chunks_of(listed, scene.vertex_counts[listed], device)
    inputs = [chunks, scene.records, wp.array(rows, dtype=wp.vec4d, device=device), corners]
    launch.launch(project_vertices, count, inputs, device)


@dataclass(frozen=True, eq=False)
class Drawing:
    """A z-buffer of a band, and the corners of what is drawn in it."""

    keys: wp.array
    """(h * w,) int64: nearness of what a pixel sees, then its triangle; 0 where nothing is seen."""
    corners: wp.array
    """(all objects' vertices,) vec3d in pixels of the whole image."""
    band: Band

    @classmethod
    def empty(
        cls, scene: DeviceScene, camera: Camera, band: Band | None = None, corners: wp.array | None = None
    ) -> Drawing:
        """An empty z-buffer of a band, or of the whole image; with corners that are known, or with room for them."""
        band = band or whole_image(camera)
        keys = wp.zeros(camera.width * band.rows, dtype=wp.int64, device=scene.device)
        return cls(keys, empty_corners(scene) if corners is None else corners, band)

    def over(self) -> Drawing:
        """A copy to draw other objects over."""
        return Drawing(wp.clone(self.keys), self.corners, self.band)

    def add(self, scene: DeviceScene, camera: Camera, numbers: Iterable[int]) -> None:
        """Draw the objects of these numbers."""
        listed = list(numbers)
        project(scene, camera, listed, self.corners)
        self.draw(scene, camera, listed)

    def draw(self, scene: DeviceScene, camera: Camera, numbers: Sequence[int]) -> None:
        """Draw the objects of these numbers, whose corners are known."""
        device, drawn = scene.device, np.array(numbers, np.int64)
        counts = scene.triangle_counts[drawn]
        chunks, count = chunks_of(drawn, counts, device)
        large = wp.zeros(1, dtype=wp.int32, device=device)
        listed = wp.empty(int(counts.sum()), dtype=wp.int32, device=device)
        target = [scene.records, self.corners, camera.width, self.band.first_row, self.band.first_row + self.band.rows]
        launch.launch(draw_small_triangles, count, [chunks, *target, self.keys, large, listed], device)
        strips = int(large.numpy()[0]) * -(-self.band.rows // int(STRIP))
        launch.launch(draw_large_triangles, strips, [listed, *target, self.keys], device)
