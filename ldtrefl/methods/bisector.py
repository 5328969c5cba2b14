"""Virtual vertices by a search in image space: P. Estalella, I. Martin, G. Drettakis, D. Tost, "A GPU-driven algorithm
for accurate interactive reflections on curved objects" (2006).

Each reflector is drawn alone from the eye, its positions and normals kept as textures, in a view that is ``widening``
times as wide as the image (section 5.2). For each vertex of the other objects the texel is searched for whose normal is
nearest to the bisector of the ways to the eye and to the vertex (section 4), from the
middle of the reflector on. There the vertex is mirrored at the tangent
plane.

A vertex that is found to lie behind that plane is hidden (region C). It is placed by the inverse search (section 5.1,
equation 1), as the authors do it in practice: mirrored at the plane that the search ended at, so that it stands before
the reflector, and triangles between seen and hidden vertices end where they must. Equation 1 as it is printed turns the
vertex about the normal; mirrored it must be, or virtual vertices would jump at the border of region C.

    ldtrefl render scene.toml --method bisector --set widening=1.5

Fails: reflection points lie at texels, so reflections are off by as much, and shake; triangles have straight edges in
the mirror, so coarse objects are not bent; where a vertex has several reflections, on concave reflectors and those of
mixed curvature, the nearest best texel is taken; what would be reflected twice is not; beyond the wider view vertices
are put at its border.
"""

from __future__ import annotations

import functools
from typing import Annotated

import warp as wp
from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.geometry.vectors import as_double
from ldtrefl.methods.base import CONFIG, CommonConfig, RayMethod
from ldtrefl.methods.virtual.image import DrawnVertices, VirtualImage
from ldtrefl.methods.virtual.reflector_texture import ReflectorTexture, texture_of, wider
from ldtrefl.methods.virtual.texel_search import search_texel
from ldtrefl.methods.virtual.vertex import HIDDEN, VirtualVertex, device_vertex, unfolded, vertex_chunk
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.camera import CameraView
from ldtrefl.world.records import ObjectRecord


@launch.kernel
def search_vertices(
    first: int,
    # In:
    camera: CameraView,
    texture: ReflectorTexture,
    chunks: wp.array(dtype=wp.vec2i),
    numbers: wp.array(dtype=wp.int32),
    first_vertex: wp.array(dtype=wp.int32),
    objects: wp.array(dtype=ObjectRecord),
    # Out:
    vertices_out: wp.array(dtype=VirtualVertex),
    steps_out: wp.array(dtype=wp.int32),
):
    """Search for where the reflector shows each vertex of one chunk."""
    chunk = vertex_chunk(chunks, numbers, first_vertex, objects, first + wp.tid())
    for i in range(chunk.begin, chunk.end):
        k = chunk.first + i
        vertex = device_vertex(objects[chunk.object], i)
        found = search_texel(texture, texture.start, camera.eye, vertex)
        steps_out[k] = found.steps
        point, normal = texture.position[found.texel], as_double(texture.normal[found.texel])
        height = wp.dot(vertex - point, normal)
        made = unfolded(camera.eye, point, vertex, wp.dot(point - camera.eye, camera.forward))
        if height <= wp.float64(0.0) and made.is_seen != 0:
            # Equation 1, mirrored: the vertex whose virtual image this one would be.
            made.position = vertex - wp.float64(2.0) * height * normal
            made.is_seen = HIDDEN
        vertices_out[k] = made


class Bisector(RayMethod):
    """Vertices mirrored where a search in the image finds normal and bisector alike: quick, for smooth convex mirrors
    of finely tessellated objects, off by a texel."""

    name = "bisector"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``bisector``."""

        widening: Annotated[float, Field(ge=1.0, le=8.0)] = 1.25
        """How many times as wide as the image the view is in which the reflector is searched, 1 to 8."""
        fineness: Annotated[float, Field(ge=0.25, le=8.0)] = 1.0
        """Texels of that view along a pixel, 0.25 to 8."""

    config: Config

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Search for the vertices of all objects in each reflector that is seen, and draw them there."""
        scene, device = self.scene, self.scene.device
        image = VirtualImage(gbuffer, rays)
        stats.count("rays", rays.pixel.shape[0])
        view = wider(gbuffer.camera, self.config.widening, self.config.fineness)
        with stats.stage("virtual", device):
            for reflector in image.reflectors:
                texture = texture_of(scene, reflector, view)
                if texture.start >= 0:
                    image.draw(reflector, functools.partial(self._search, gbuffer, texture, stats))
        with stats.stage("shade", device):
            return image.reflected(shadow_tracer(self.tracer, scene, stats))

    def _search(self, gbuffer: GBuffer, texture: ReflectorTexture, stats: Stats, placed: DrawnVertices) -> None:
        """Search for the vertices of all objects that are drawn."""
        count, device = placed.vertices.shape[0], self.scene.device
        steps = wp.zeros(count, dtype=wp.int32, device=device)
        inputs = [gbuffer.view.camera, texture, placed.chunks, placed.numbers, placed.first_vertex, self.scene.records]
        inputs += [placed.vertices, steps]
        launch.launch(search_vertices, placed.chunks.shape[0], inputs, device)
        stats.count("vertices", count)
        stats.count("steps", int(steps.numpy().sum()))
