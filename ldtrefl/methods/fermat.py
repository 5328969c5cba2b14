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
  have curved ones, and neighbours of different fineness show gaps (4.5, Fig. 12). Tessellate the scene finely, or have
  its triangles taken to pieces (``levels``), as ``tessellation`` does it.
- A thin layer on something larger may vanish in it here and there, as depths are interpolated, too (4.5, Fig. 13).
- In a concave reflector a point may be mirrored several times: one is shown. Triangles that cross the zone in which
  they are many, or that turn upside down, are torn (4.4, Fig. 11).
- A ray is mirrored once: reflections of the reflector in itself, and of other mirrors, show the environment (4.4).
- The reflector must be star-shaped and smooth. One that is not star-shaped is refused by name; on edges, and where
  ``smooth = false`` makes every facet a flat mirror, a vertex has several reflections, or none that is found.
- A triangle of which a corner is not found, or lies within the reflector, is left out whole: of large triangles a ring
  at the mirror's border may be missing.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.base import budget
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.methods.base import CONFIG, CommonConfig, RayMethod
from ldtrefl.methods.virtual.fermat_places import FermatPlaces
from ldtrefl.methods.virtual.fermat_search import SearchLimits
from ldtrefl.methods.virtual.image import VirtualImage
from ldtrefl.methods.virtual.radius_map import RadiusMap
from ldtrefl.methods.virtual.star_shape import star_shape_of
from ldtrefl.methods.virtual.subdivision import Subdivider, Subdivision
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
        levels: Annotated[int, Field(strict=True, ge=0, le=8)] = 0
        """Rounds in which triangles are divided where the mirror bends them, 0 to 8."""
        threshold: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0002
        """The error of an edge, 0 to 1, from which it is divided."""
        crack_free: Annotated[bool, Field(strict=True)] = True
        """Whether edges are divided by their own errors, so that no holes open between triangles."""

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
                self._draw(image, reflector, gbuffer.view.camera, stats)
        with stats.stage("shade", device):
            return image.reflected(shadow_tracer(self.tracer, scene, stats))

    def _radius_map(self, reflector: int) -> RadiusMap:
        """A reflector's map."""
        side, name = self.config.resolution + 1, self.scene.objects[reflector].source.called
        budget.take(NODE_BYTES * 6 * side * side, f"the map of radii of '{name}'", "resolution")
        shape = star_shape_of(self.scene.objects[reflector], self.scene.device_from_world)
        return shape.radius_map(self.config.resolution, self.scene.device)

    def _draw(self, image: VirtualImage, reflector: int, camera: CameraView, stats: Stats) -> None:
        """Draw what a reflector shows; triangles are first taken to pieces if there are ``levels``."""
        config = self.config
        places = FermatPlaces(camera, self._maps[reflector], self._limits(camera), stats)
        if config.levels:
            rule = Subdivision(config.threshold, config.levels, config.crack_free)
            image.draw_pieces(reflector, Subdivider(self.scene, rule, places, places.errors, stats))
        else:
            image.draw(reflector, places)

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
