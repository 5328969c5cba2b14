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
from ldtrefl.methods.virtual.raster import DrawnPoints, draw_back_faces, draw_virtual, resolve_points
from ldtrefl.methods.virtual.vertex import VirtualVertex
from ldtrefl.tracing.ray_buffers import RayBuffer, RayEnds, empty_hits
from ldtrefl.tracing.tracer import BoundTracer
from ldtrefl.world.camera import CameraView

VERTEX_BYTES = 48
"""Bytes of a virtual vertex and of its place."""


@dataclass(frozen=True, eq=False)
class DrawnVertices:
    """The vertices that a method places, and where."""

    drawn: np.ndarray
    """(n,) int32 numbers of the objects."""
    chunks: wp.array
    """vec2i: the vertices of these objects in chunks (``chunks_of``)."""
    numbers: wp.array
    """(n,) int32: ``drawn`` on the device."""
    first_vertex: wp.array
    """(n,) int32: the place of each object's vertex 0."""
    vertices: wp.array
    """VirtualVertex of all of them, to be filled in."""


PlaceVertices = Callable[[DrawnVertices], None]
"""Fills in virtual vertices."""


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

    def draw(self, reflector: int, place_vertices: PlaceVertices, chosen: np.ndarray | None = None) -> None:
        """Draw what a mirror shows of all other objects.

        Args:
            reflector: the mirror.
            place_vertices: places the vertices of the others where it shows them.
            chosen: (n,) bool, the rays of the part of the mirror that shows them so; all of its rays if not given. A
                ray is drawn to once: what is drawn later replaces it.

        Raises:
            InputError: the vertices need more memory than is allowed, or the scene has too many triangles.
        """
        scene, device = self._gbuffer.scene, self._gbuffer.scene.device
        if scene.triangle_numbers.shift:
            raise InputError("the scene has more than 2^31 triangles: use method ldt or bvh")
        is_drawn = self._given.source.numpy() == reflector
        if chosen is not None:
            is_drawn &= chosen
        rays = np.flatnonzero(is_drawn)
        drawn = np.delete(np.arange(len(scene.objects), dtype=np.int32), reflector)
        if not len(rays) or not len(drawn):
            return
        points, order = self._points(rays)
        ray_of = wp.array(order.astype(np.int32), dtype=wp.int32, device=device)
        counts = scene.vertex_counts[drawn]
        with budget.given_back():
            budget.take(VERTEX_BYTES * int(counts.sum()), "the virtual vertices of the scene", "the number of vertices")
            placed = self._room_for(drawn, counts)
            place_vertices(placed)
            camera = self._gbuffer.view.camera
            keys, backs = (wp.zeros(len(order), dtype=wp.int64, device=device) for _ in range(2))
            self._draw_backs(points, ray_of, reflector, backs)
            chunks = chunks_of(scene.triangle_counts[drawn], device)
            inputs = [camera, points, chunks, placed.numbers, placed.first_vertex, placed.vertices, scene.records]
            launch.launch(draw_virtual, chunks.shape[0], [*inputs, scene.triangle_numbers, backs, keys], device)
            first_of = np.zeros(len(scene.objects), np.int32)
            first_of[drawn] = placed.first_vertex.numpy()
            places = wp.array(first_of, dtype=wp.int32, device=device)
            inputs = [camera, points, keys, ray_of, places, placed.vertices, scene.records, scene.triangle_numbers]
            launch.launch(resolve_points, len(order), [*inputs, self._rays, self._hits], device)

    def _room_for(self, drawn: np.ndarray, counts: np.ndarray) -> DrawnVertices:
        """Room for the vertices of objects that have so many each."""
        device = self._gbuffer.scene.device
        first = (np.cumsum(counts) - counts).astype(np.int32)
        return DrawnVertices(
            drawn,
            chunks_of(counts, device),
            wp.array(drawn, dtype=wp.int32, device=device),
            wp.array(first, dtype=wp.int32, device=device),
            wp.empty(int(counts.sum()), dtype=VirtualVertex, device=device),
        )

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

    def _draw_backs(self, points: DrawnPoints, ray_of: wp.array, reflector: int, backs: wp.array) -> None:
        """Draw the frontmost back faces of a mirror behind what is seen of it."""
        scene, camera = self._gbuffer.scene, self._gbuffer.view.camera
        depth = wp.empty(ray_of.shape[0], dtype=float, device=scene.device)
        launch.launch(find_depths, ray_of.shape[0], [camera, self._given, ray_of, depth], scene.device)
        count = chunk_count(int(scene.triangle_counts[reflector]))
        inputs = [camera, points, depth, scene.records, reflector, backs]
        launch.launch(draw_back_faces, count, inputs, scene.device)

    def reflected(self, shadow: BoundTracer) -> ReflectedLight:
        """What reaches the reflector pixels by way of their mirrors, with shadows by this tracer."""
        gbuffer, given = self._gbuffer, self._given
        brought = wp.zeros(given.pixel.shape[0], dtype=wp.vec3, device=gbuffer.scene.device)
        shade_ends(gbuffer, self._rays, self._hits, shadow, brought, least_weight=np.inf)
        units = gbuffer.scene.device_units_per_world_unit
        hits = FirstHits(gbuffer.shape, RayEnds.of(given, self._hits), units, given)
        return ReflectedLight(summed_by_pixel(gbuffer.reflector_pixels, given, brought), hits)
