"""The z-buffer: which triangle is nearest in each pixel, and how near.

Objects are drawn together by the same three launches, however many there are: their vertices and triangles are handed
out in chunks. As many are drawn together as there is room for their corners. Objects of which many have the same mesh
are drawn by ``instances.py``. The triangles are those of ``geometry/perspective_raster.py``. Of some objects the
triangles are not drawn at all: pixels' rays are searched for in them, after all others are drawn
(``searched_pixels.py``).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK
from ldtrefl.frame.drawn_objects import DrawnObjects
from ldtrefl.frame.instances import draw_all_instances, instances_among
from ldtrefl.frame.large_triangles import LargeTriangles, draw_or_set_aside, draw_those_set_aside, none_set_aside
from ldtrefl.frame.projection import DrawnObject, chunks_of, project_vertices
from ldtrefl.frame.searched_pixels import CameraSearch, numbers_of, search_pixels
from ldtrefl.frame.triangle_rows import Target, Triangle
from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import Band
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.triangle_numbers import TriangleNumbers, number_of

CORNERS_KEPT = 1 << 22
"""Corners that are kept till it is known what pixels see: 96 MiB. Where all objects together have more, they are found
again."""

CORNERS_TOGETHER = 1 << 18
"""Corners of objects that are drawn together where corners are not kept: 6 MiB, which caches hold. A single object may
have more."""


@launch.kernel
def draw_triangles(
    first: int,
    # In:
    chunks: wp.array(dtype=wp.vec2i),  # ``chunks_of`` triangles
    objects: wp.array(dtype=ObjectRecord),
    drawn: wp.array(dtype=DrawnObject),
    numbers: TriangleNumbers,
    corners: wp.array(dtype=wp.vec3d),
    # Out:
    target: Target,
    large: LargeTriangles,
):
    """Draw the triangles of one chunk, but set those aside whose boxes are large."""
    chunk = first + wp.tid()
    place = chunks[chunk][0]
    index = drawn[place].object
    first_corner = drawn[place].first_corner
    faces = objects[index].faces
    i = int(chunks[chunk][1])
    end = wp.min(i + CHUNK, faces.shape[0])
    while i < end:
        triangle = Triangle()
        triangle.a = corners[first_corner + faces[i][0]]
        triangle.b = corners[first_corner + faces[i][1]]
        triangle.c = corners[first_corner + faces[i][2]]
        triangle.number = number_of(numbers, index, i)
        draw_or_set_aside(target, triangle, place, i, large)
        i += 1


@dataclass(frozen=True, eq=False)
class CornerRoom:
    """Room for the corners of objects that are drawn together."""

    corners: wp.array
    """(m,) vec3d: all objects' if they are kept, else none."""
    first: np.ndarray
    """(objects,) int64, the place of each object's vertex 0; -1 if its corners are not kept."""
    keeps: bool
    """Whether the corners of what is drawn are kept."""

    @classmethod
    def of(cls, scene: DeviceScene, without: np.ndarray) -> CornerRoom:
        """Room for all corners of a scene's objects but those of these numbers, or none if they are too many."""
        counts = scene.vertex_counts.copy()
        counts[without] = 0
        total, first = int(counts.sum()), np.cumsum(counts) - counts
        first[without] = -1
        keeps = total <= CORNERS_KEPT
        if not keeps:
            total, first = 0, np.full_like(first, -1)
        return cls(wp.empty(total, dtype=wp.vec3d, device=scene.device), first, keeps)


@dataclass(frozen=True, eq=False)
class DrawnPart:
    """Objects that were drawn together."""

    objects: DrawnObjects
    first_corners: np.ndarray
    """(n,) the place of each object's first corner, -1 if its corners are not kept."""


class Drawing:
    """A z-buffer of a band of an image, and what was drawn in it."""

    def __init__(self, camera: Camera, band: Band, room: CornerRoom) -> None:
        """Empty: nothing is seen. There is room for the corners of all that will be drawn."""
        self.camera = camera
        self.band = band
        self.room = room
        self.keys = wp.zeros(camera.width * band.rows, dtype=wp.int64, device=room.corners.device)
        """(h * w,) int64: nearness of what a pixel sees, then its triangle's number; 0 where nothing is seen."""
        self.drawn: list[DrawnPart] = []
        """What was drawn or searched."""

    def over(self) -> Drawing:
        """A copy to draw other objects over."""
        copy = Drawing.__new__(Drawing)
        copy.camera, copy.band, copy.room = self.camera, self.band, self.room
        copy.keys, copy.drawn = wp.clone(self.keys), list(self.drawn)
        return copy

    def draw(
        self,
        scene: DeviceScene,
        objects: DrawnObjects,
        search: CameraSearch | None = None,
        *,
        are_projected: bool = False,
    ) -> None:
        """Draw objects, and search in those that ``search`` has; ``are_projected`` says that corners that are kept are
        in the room already."""
        are_searched = np.isin(objects.numbers, numbers_of(search))
        self._draw_all(scene, objects.some(~are_searched), are_projected=are_projected)
        if search is not None and are_searched.any():
            searched = objects.some(are_searched)
            self.drawn.append(DrawnPart(searched, np.full(len(searched.numbers), -1)))
            search_pixels(scene, self.camera, self.band, searched, search.tracer, self._target())

    def _draw_all(self, scene: DeviceScene, objects: DrawnObjects, *, are_projected: bool) -> None:
        """Draw objects, as instances or apart."""
        are_instances = instances_among(scene, self.camera, objects)
        if not are_instances.any():
            self._draw_apart(scene, objects, are_projected=are_projected)
            return
        self._draw_apart(scene, objects.some(~are_instances), are_projected=are_projected)
        instances = objects.some(are_instances)
        self.drawn.append(DrawnPart(instances, np.full(len(instances.numbers), -1)))
        draw_all_instances(scene, instances, self._target())

    def _draw_apart(self, scene: DeviceScene, objects: DrawnObjects, *, are_projected: bool) -> None:
        """Draw objects that are not instances."""
        first, device = self.room.first[objects.numbers], scene.device
        if self.room.keeps:
            drawn = objects.on_device(first, device)
            self.drawn.append(DrawnPart(objects, first))
            self._draw(scene, objects.numbers, drawn, self.room.corners, are_projected=are_projected)
            return
        self.drawn.append(DrawnPart(objects, first))
        for part, counts in _parts(scene.vertex_counts[objects.numbers]):
            corners = wp.empty(int(counts.sum()), dtype=wp.vec3d, device=device)
            drawn = objects.some(part).on_device(np.cumsum(counts) - counts, device)
            self._draw(scene, objects.numbers[part], drawn, corners, are_projected=False)

    def _draw(
        self, scene: DeviceScene, numbers: np.ndarray, drawn: wp.array, corners: wp.array, *, are_projected: bool
    ) -> None:
        """Draw the objects of these numbers, for whose corners there is room."""
        device, records = scene.device, scene.records
        if not are_projected:
            chunks = chunks_of(scene.vertex_counts[numbers], device)
            launch.launch(project_vertices, chunks.shape[0], [chunks, records, drawn, corners], device)
        chunks = chunks_of(scene.triangle_counts[numbers], device)
        target, large = self._target(), none_set_aside(device)
        inputs = [chunks, records, drawn, scene.triangle_numbers, corners, target, large]
        launch.launch(draw_triangles, chunks.shape[0], inputs, device)
        draw_those_set_aside(large, records, drawn, scene.triangle_numbers, corners, target)

    def _target(self) -> Target:
        """The z-buffer as kernels draw to it."""
        target = Target()
        target.keys, target.width = self.keys, self.camera.width
        target.first_row, target.end_row = self.band.first_row, self.band.first_row + self.band.rows
        return target


def _parts(counts: np.ndarray) -> Iterator[tuple[slice, np.ndarray]]:
    """Slices of objects that are drawn together, with the number of vertices of each object."""
    ends, begin = np.cumsum(counts), 0
    while begin < len(counts):
        before = ends[begin] - counts[begin]
        end = max(begin + 1, int(np.searchsorted(ends, before + CORNERS_TOGETHER, side="right")))
        yield slice(begin, end), counts[begin:end]
        begin = end
