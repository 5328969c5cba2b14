"""Fermat's principle: D. Roger, N. Holzschuch, "Accurate Specular Reflections in Real-Time" (2006).

For each vertex of the scene the point of a star-shaped reflector is found that mirrors it: by it the light's path from
the eye has extremal length. The triangles between these points are drawn.

    ldtrefl render scene.toml --method fermat --set resolution=128 --set iterations=20 --set area=0.01

The reflector is its radius over directions, ``P = O + r(u) u``, as a cube map of r and its gradient (sections 3.3.1 and
3.3.2; ``virtual/star_shape.py``). A secant search on the gradient of the path's length, equation (1), finds P
(3.3.2 to 3.3.4; ``virtual/fermat_search.py``). What is drawn between vertices is shaded at the true point with the
reflection as the eye (3.3.5), and hidden by what is nearer to the reflector and by the reflector's own back faces
(3.3.6; ``virtual/image.py``).

Counters: ``vertices``, those searched for; ``vertices_found``, those that are mirrored or that the reflector hides;
``iterations``, the samples of all searches (Fig. 3(c) has 5 to 10 a vertex, up to 20 near the silhouette). A triangle
that the reflector hides in part is mirrored up to the silhouette (``virtual/silhouette.py``), on which the paper is
silent.

Fails, as the paper says:

- Between vertices all is interpolated linearly: the reflection of a long triangle has straight edges where it should
  have curved ones, and neighbours of different fineness show gaps (4.5, Fig. 12). Tessellate the scene finely.
- A thin layer on something larger may vanish in it here and there, as depths are interpolated, too (4.5, Fig. 13).
- In a concave reflector a point may be mirrored several times: one is shown. Triangles that cross the zone in which
  they are many, or that turn upside down, are torn (4.4, Fig. 11).
- A ray is mirrored once: reflections of the reflector in itself, and of other mirrors, show the environment (4.4).
- The reflector must be star-shaped and smooth. One that is not star-shaped is refused by name; on edges, and where
  ``smooth = false`` makes every facet a flat mirror, a vertex has several reflections, or none that is found.
- A triangle of which a corner is not found, or lies within the reflector, is left out whole.
"""

from __future__ import annotations

import dataclasses
from typing import Annotated

import numpy as np
import warp as wp
from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.methods.base import CONFIG, CommonConfig, RayMethod
from ldtrefl.methods.virtual.fermat_search import SearchLimits, fermat_search
from ldtrefl.methods.virtual.image import VirtualImage
from ldtrefl.methods.virtual.radius_map import RadiusMap, radial_point
from ldtrefl.methods.virtual.silhouette import silhouette_point
from ldtrefl.methods.virtual.star_shape import star_shape_of
from ldtrefl.methods.virtual.vertex import HIDDEN, VirtualVertex, not_seen, unfolded
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.tracer import SceneTracer
from ldtrefl.world.camera import CameraView
from ldtrefl.world.device_scene import DeviceScene

NODE_BYTES = 16
"""Bytes of a node of a map."""

MOST_RESIDUAL = 0.02
"""Radians between the mirrored view and the way to the vertex up to which a vertex counts as found. A search that ends
by its area is within a small part of that; one that has found nothing is far from it."""

search = fermat_search(RadiusMap, radial_point)


@launch.kernel
def find_vertices(
    first: int,
    # In:
    camera: CameraView,
    surface: RadiusMap,
    limits: SearchLimits,
    points: wp.array(dtype=wp.vec3d),
    # Out:
    vertices_out: wp.array(dtype=VirtualVertex),
    iterations_out: wp.array(dtype=wp.int32),
):
    """Search for the reflection of one point."""
    i = first + wp.tid()
    eye, vertex = camera.eye - surface.centre, points[i]
    found = search(surface, eye, vertex - surface.centre, limits)
    made = not_seen()
    point = found.point
    if found.is_hidden != 0:
        point = silhouette_point(surface, eye, found.point)
    if found.is_found + found.is_hidden != 0:
        made = unfolded(camera.eye, surface.centre + point, vertex, wp.dot(point - eye, camera.forward))
        if found.is_hidden != 0 and made.is_seen != 0:
            made.is_seen = HIDDEN
    vertices_out[i] = made
    iterations_out[i] = found.iterations


@dataclasses.dataclass(frozen=True, eq=False)
class FermatPlaces:
    """Places vertices where one reflector shows them."""

    camera: CameraView
    surface: RadiusMap
    limits: SearchLimits
    stats: Stats

    def __call__(self, points: wp.array, vertices: wp.array) -> None:
        """Fill in the virtual vertices of (n,) vec3d points."""
        count, device = points.shape[0], points.device
        iterations = wp.zeros(count, dtype=wp.int32, device=device)
        inputs = [self.camera, self.surface, self.limits, points, vertices, iterations]
        launch.launch(find_vertices, count, inputs, device)
        self.stats.count("vertices", count)
        self.stats.count("vertices_found", int((vertices.numpy()["is_seen"] != 0).sum()))
        self.stats.count("iterations", int(iterations.numpy().sum()))


class Fermat(RayMethod):
    """Each vertex of the scene where a smooth star-shaped mirror shows it: near things right, if finely tessellated."""

    name = "fermat"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``fermat``."""

        resolution: Annotated[int, Field(strict=True, ge=8, le=2048)] = 128
        """Intervals between the nodes of a reflector's cube map, along a side of each face, 8 to 2048."""
        iterations: Annotated[int, Field(strict=True, ge=1, le=1000)] = 20
        """The most samples of the reflector that the search for a vertex takes after its first three, 1 to 1000."""
        area: Annotated[float, Field(strict=True, ge=0.0, le=100.0)] = 0.01
        """Area in pixels of the image that the triangle of samples covers when a search ends, 0 to 100."""

    config: Config

    def __init__(self, scene: DeviceScene, config: CommonConfig, tracer: SceneTracer) -> None:
        super().__init__(scene, config, tracer)
        self._maps: dict[int, RadiusMap] = {}
        """By number of the reflector."""

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved."""
        for number in scene.moved_since(self.scene):
            self._maps.pop(number, None)
        super().place(scene)

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Draw for each reflector that is seen all other objects where it shows them.

        Raises:
            NotForThisScene: a reflector that is seen is not star-shaped.
        """
        scene, device = self.scene, self.scene.device
        image = VirtualImage(gbuffer, rays)
        stats.count("rays", rays.pixel.shape[0])
        for reflector in image.reflectors:
            if reflector not in self._maps:
                with stats.stage("radius_map", device):
                    self._maps[reflector] = self._radius_map(reflector)
            with stats.stage("virtual", device):
                camera = gbuffer.view.camera
                image.draw(reflector, FermatPlaces(camera, self._maps[reflector], self._limits(camera), stats))
        with stats.stage("shade", device):
            return image.reflected(shadow_tracer(self.tracer, scene, stats))

    def _radius_map(self, reflector: int) -> RadiusMap:
        """A reflector's map."""
        side, name = self.config.resolution + 1, self.scene.objects[reflector].source.called
        budget.take(NODE_BYTES * 6 * side * side, f"the map of radii of '{name}'", "resolution")
        shape = star_shape_of(self.scene.objects[reflector], self.scene.device_from_world)
        return shape.radius_map(self.config.resolution, self.scene.device)

    def _limits(self, camera: CameraView) -> SearchLimits:
        """When searches end."""
        limits = SearchLimits()
        limits.most_iterations, limits.most_residual = self.config.iterations, MOST_RESIDUAL
        limits.least_solid_angle = self.config.area * _pixel_solid_angle(camera)
        return limits


def _pixel_solid_angle(camera: CameraView) -> float:
    """Steradian of a pixel in the middle of the image."""
    sides = [2.0 * float(np.linalg.norm(camera.right)) / camera.width]
    sides.append(2.0 * float(np.linalg.norm(camera.down)) / camera.height)
    return sides[0] * sides[1]
