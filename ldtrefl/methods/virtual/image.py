"""What mirrors show, drawn from virtual vertices.

A method makes a ``VirtualImage`` of a frame, draws into it for each mirror that is seen, and takes what they reflect.
What is drawn becomes the hits of the rays that leave the mirrors, and these are shaded as hits of rays are: at the true
point of the surface, with the reflection point as the eye (Roger and Holzschuch 2006, section 3.3.5). Where nothing is
drawn the environment is seen. A mirror that is seen in a mirror shows the environment alone, as it does to rays that
have no bounces left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.bins import chunk_count
from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.bounces import shade_ends, summed_by_pixel
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.projection import chunks_of
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.frame.sample_points import SamplePoints
from ldtrefl.frame.taken_rays import taken
from ldtrefl.methods.virtual.raster import (
    DrawnPoints,
    draw_back_faces,
    draw_pieces,
    draw_virtual,
    resolve_pieces,
    resolve_points,
)
from ldtrefl.methods.virtual.vertex import VirtualVertex, find_points
from ldtrefl.tracing.ray_buffers import RayBuffer, RayEnds, empty_hits
from ldtrefl.tracing.tracer import BoundTracer
from ldtrefl.world.camera import CameraView
from ldtrefl.world.device_scene import DeviceScene

VERTEX_BYTES = 96
"""Bytes of a virtual vertex and of the point that it stands for."""


PlaceVertices = Callable[[wp.array, wp.array], None]
"""``place(points, vertices_out)``: fills in the virtual vertices of (n,) vec3d points in device space."""


BEFORE = 0.25
"""How far before what is seen of a mirror a reflection point may lie, in radii of the mirror. Between the reflection
points of a triangle's corners lie chords: on the inner side of a bowl they are before its surface."""


@launch.kernel
def find_depths(
    first: int,
    # In:
    camera: CameraView,
    rays: RayBuffer,
    ray_of: wp.array(dtype=wp.int32),
    # Out:
    depth_out: wp.array(dtype=float),
):
    """Find the depth along the camera's axis at which one ray leaves its mirror."""
    i = first + wp.tid()
    away = rays.origin[ray_of[i]] - camera.eye
    depth_out[i] = float(wp.dot(away, camera.forward))


@dataclass(frozen=True, eq=False)
class DrawnMeshes:
    """The objects that a mirror may show, and the place of their vertices in arrays of all of them."""

    numbers: np.ndarray
    """(n,) int32."""
    first_vertex: np.ndarray
    """(n,) int32: the place of each one's vertex 0."""
    vertex_count: int

    @classmethod
    def of(cls, scene: DeviceScene, numbers: np.ndarray) -> DrawnMeshes:
        """The objects of these numbers."""
        counts = scene.vertex_counts[numbers]
        return cls(numbers, (np.cumsum(counts) - counts).astype(np.int32), int(counts.sum()))

    def points(self, scene: DeviceScene) -> wp.array:
        """(vertices,) vec3d in device space.

        Raises:
            InputError: they need more memory than is allowed.
        """
        device = scene.device
        budget.take(VERTEX_BYTES * self.vertex_count, "the virtual vertices of the scene", "the number of vertices")
        chunks = chunks_of(scene.vertex_counts[self.numbers], device)
        points = wp.empty(self.vertex_count, dtype=wp.vec3d, device=device)
        arrays = [wp.array(values, dtype=wp.int32, device=device) for values in (self.numbers, self.first_vertex)]
        launch.launch(find_points, chunks.shape[0], [chunks, *arrays, scene.records, points], device)
        return points


Subdivide = Callable[[DrawnMeshes], tuple[wp.array, wp.array]]
"""From meshes to (n,) ``Piece`` of their triangles and (m,) ``VirtualVertex`` that are the pieces' corners."""


@dataclass(frozen=True, eq=False)
class _Part:
    """A mirror, or a part of one, as it is drawn to."""

    points: DrawnPoints
    ray_of: wp.array
    """(n,) int32: the ray that leaves it at each point."""
    fronts: wp.array
    """(n,) float: the least depth of a reflection point that may be seen there."""
    backs: wp.array
    """(n,) int64 of ``draw_back_faces``."""


class VirtualImage:
    """What the mirrors of a frame, or of a band of one, show."""

    def __init__(self, gbuffer: GBuffer, rays: RayBuffer) -> None:
        """Empty: all mirrors show the environment.

        Args:
            gbuffer: what the camera sees.
            rays: those that leave its reflector pixels. They stay as they are.
        """
        count, self._gbuffer, device = rays.pixel.shape[0], gbuffer, gbuffer.scene.device
        self._given = rays
        self._rays = taken(rays, np.arange(count))
        self._hits = empty_hits(count, device)
        self._hits.t.fill_(np.inf)
        self._hits.object.fill_(-1)
        self._hits.triangle.fill_(-1)
        self._hits.barycentrics.zero_()
        self._places = self._all_places()

    def _all_places(self) -> np.ndarray:
        """(n, 2) float64: where in the band's image each ray's pixel or point is."""
        pixel = self._given.pixel.numpy()
        if isinstance(self._gbuffer, SamplePoints):
            places: np.ndarray = self._gbuffer.view.place.numpy()[pixel]
            return places
        width = self._gbuffer.camera.width
        return np.stack([pixel % width, pixel // width], axis=1) + 0.5

    @property
    def reflectors(self) -> Iterator[int]:
        """The numbers of the objects that are seen as mirrors."""
        yield from (number for number in np.unique(self._given.source.numpy()).tolist() if number >= 0)

    def draw(self, reflector: int, place: PlaceVertices, chosen: np.ndarray | None = None) -> None:
        """Draw what a mirror shows of all other objects.

        Args:
            reflector: the mirror.
            place: places the vertices of the others where it shows them.
            chosen: (n,) bool, the rays of the part of the mirror that shows them so; all of its rays if not given. A
                ray is drawn to once: what is drawn later replaces it.

        Raises:
            InputError: the vertices need more memory than is allowed, or the scene has too many triangles.
        """
        part, others = self._part(reflector, chosen), self._others(reflector)
        if part is None or not len(others.numbers):
            return
        scene, device = self._gbuffer.scene, self._gbuffer.scene.device
        with budget.given_back():
            points = others.points(scene)
            vertices = wp.empty(points.shape[0], dtype=VirtualVertex, device=device)
            place(points, vertices)
            keys = wp.zeros_like(part.backs)
            numbers = wp.array(others.numbers, dtype=wp.int32, device=device)
            first = wp.array(others.first_vertex, dtype=wp.int32, device=device)
            chunks = chunks_of(scene.triangle_counts[others.numbers], device)
            inputs = [self._camera, part.points, chunks, numbers, first, vertices, scene.records]
            launch.launch(
                draw_virtual, chunks.shape[0], [*inputs, scene.triangle_numbers, part.fronts, part.backs, keys], device
            )
            first_of = np.zeros(len(scene.objects), np.int32)
            first_of[others.numbers] = others.first_vertex
            inputs = [self._camera, part.points, keys, part.ray_of, wp.array(first_of, dtype=wp.int32, device=device)]
            inputs += [vertices, scene.records, scene.triangle_numbers, self._rays, self._hits]
            launch.launch(resolve_points, keys.shape[0], inputs, device)

    def draw_pieces(self, reflector: int, subdivide: Subdivide) -> None:
        """Draw what a mirror shows of all other objects, whose triangles are first taken to pieces.

        Raises:
            InputError: the pieces need more memory than is allowed.
        """
        part, others = self._part(reflector, None), self._others(reflector)
        if part is None or not len(others.numbers):
            return
        scene, device = self._gbuffer.scene, self._gbuffer.scene.device
        with budget.given_back():
            pieces, vertices = subdivide(others)
            keys = wp.zeros_like(part.backs)
            inputs = [self._camera, part.points, pieces, vertices, part.fronts, part.backs, keys]
            launch.launch(draw_pieces, pieces.shape[0], inputs, device)
            inputs = [self._camera, part.points, keys, part.ray_of, pieces, vertices, scene.records]
            launch.launch(resolve_pieces, keys.shape[0], [*inputs, self._rays, self._hits], device)

    @property
    def _camera(self) -> CameraView:
        return self._gbuffer.view.camera

    def _others(self, reflector: int) -> DrawnMeshes:
        scene = self._gbuffer.scene
        if scene.triangle_numbers.shift:
            raise InputError("the scene has more than 2^31 triangles: use method ldt or bvh")
        return DrawnMeshes.of(scene, np.delete(np.arange(len(scene.objects), dtype=np.int32), reflector))

    def _part(self, reflector: int, chosen: np.ndarray | None) -> _Part | None:
        """The points at which a mirror is seen, or the ``chosen`` of them; None if there are none."""
        is_drawn = self._given.source.numpy() == reflector
        if chosen is not None:
            is_drawn &= chosen
        rays = np.flatnonzero(is_drawn)
        if not len(rays):
            return None
        device = self._gbuffer.scene.device
        points, order = self._points(rays)
        ray_of = wp.array(order.astype(np.int32), dtype=wp.int32, device=device)
        backs = wp.zeros(len(order), dtype=wp.int64, device=device)
        depth = self._draw_backs(points, ray_of, reflector, backs)
        fronts = depth.numpy() - BEFORE * self._gbuffer.scene.objects[reflector].radius
        return _Part(points, ray_of, wp.array(fronts, dtype=float, device=device), backs)

    def _points(self, rays: np.ndarray) -> tuple[DrawnPoints, np.ndarray]:
        """The points that these rays leave from, and (n,) the ray of each point."""
        device, (rows, width) = self._gbuffer.scene.device, self._band_shape
        places = self._places[rays]
        x = np.clip(places[:, 0].astype(np.int64), 0, width - 1)
        y = np.clip(places[:, 1].astype(np.int64), 0, rows - 1)
        pixel = y * width + x
        order = np.argsort(pixel, kind="stable")
        first = np.zeros(rows * width + 1, np.int32)
        np.cumsum(np.bincount(pixel, minlength=rows * width), out=first[1:])
        points = DrawnPoints()
        points.first = wp.array(first, dtype=wp.int32, device=device)
        points.place = wp.array(places[order], dtype=wp.vec2d, device=device)
        points.width, points.rows = width, rows
        return points, rays[order]

    @property
    def _band_shape(self) -> tuple[int, int]:
        """Rows and pixels of a row of the band that is drawn, or that points lie in."""
        return self._gbuffer.band.rows, self._gbuffer.camera.width

    def _draw_backs(self, points: DrawnPoints, ray_of: wp.array, reflector: int, backs: wp.array) -> wp.array:
        """Draw the frontmost back faces of a mirror behind what is seen of it; (n,) float depth of the latter."""
        scene, camera = self._gbuffer.scene, self._gbuffer.view.camera
        depth = wp.empty(ray_of.shape[0], dtype=float, device=scene.device)
        launch.launch(find_depths, ray_of.shape[0], [camera, self._given, ray_of, depth], scene.device)
        count = chunk_count(int(scene.triangle_counts[reflector]))
        inputs = [camera, points, depth, scene.records, reflector, backs]
        launch.launch(draw_back_faces, count, inputs, scene.device)
        return depth

    def reflected(self, shadow: BoundTracer) -> ReflectedLight:
        """What reaches the reflector pixels by way of their mirrors, with shadows by this tracer."""
        gbuffer, given = self._gbuffer, self._given
        brought = wp.zeros(given.pixel.shape[0], dtype=wp.vec3, device=gbuffer.scene.device)
        shade_ends(gbuffer, self._rays, self._hits, shadow, brought, least_weight=np.inf)
        units = gbuffer.scene.device_units_per_world_unit
        hits = FirstHits(gbuffer.shape, RayEnds.of(given, self._hits), units, given)
        return ReflectedLight(summed_by_pixel(gbuffer.reflector_pixels, given, brought), hits)
