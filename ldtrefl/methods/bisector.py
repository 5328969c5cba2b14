"""Virtual vertices by a search in image space: P. Estalella, I. Martin, G. Drettakis, D. Tost, "A GPU-driven algorithm
for accurate interactive reflections on curved objects" (2006).

Each reflector is drawn alone from the eye, its positions and normals kept as textures, in a view that is ``widening``
times as wide as the image (section 5.2). For each vertex of the other objects the texel is searched for whose normal is
nearest to the bisector of the ways to the eye and to the vertex (section 4), from the
middle of the reflector on, or, with ``coherent``, from where the search ended in the frame before (section 5.3), which
is a few texels off while the camera moves little. Where a vertex has several best texels, as on concave reflectors,
the picture then depends on the frames before. There the vertex is mirrored at the tangent
plane.

A vertex that is found to lie behind that plane is hidden (region C). It is placed by the inverse search (section 5.1,
equation 1), as the authors do it in practice: mirrored at the plane that the search ended at, so that it stands before
the reflector, and triangles between seen and hidden vertices end where they must. Equation 1 as it is printed turns the
vertex about the normal; mirrored it must be, or virtual vertices would jump at the border of region C.

    ldtrefl render scene.toml --method bisector --set widening=1.5

With ``levels`` above 0 triangles are first taken to pieces where the mirror bends them, as ``tessellation`` does it.

Fails: reflection points lie at texels, so small reflections are off by as much and shake, and what is a few texels
large is swollen (``fineness``); flat mirrors, whose normals are all alike, are off by more. Triangles have straight
edges in the mirror: a floor of two triangles is all but missing unless it is taken to pieces. Where a vertex has
several reflections, on concave reflectors and those of mixed curvature, the best texel that the search comes to is
taken, neighbours take different ones, and triangles fan out across the mirror. What would be reflected twice is not;
beyond the wider view vertices are put at its border; open reflectors show what is beside them at their border
(region B).
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.methods.base import CONFIG, CommonConfig, RayMethod
from ldtrefl.methods.virtual.bisector_places import Texels, TextureView, draw_bisected
from ldtrefl.methods.virtual.image import VirtualImage
from ldtrefl.methods.virtual.subdivision import Subdivision
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.tracer import SceneTracer
from ldtrefl.world.device_scene import DeviceScene


class Bisector(RayMethod):
    """Vertices placed by a search in the image: for fine meshes in smooth convex mirrors, whose maps are never made."""

    name = "bisector"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``bisector``."""

        widening: Annotated[float, Field(ge=1.0, le=8.0)] = 1.25
        """How many times as wide as the image the view is in which the reflector is searched, 1 to 8."""
        fineness: Annotated[float, Field(ge=0.25, le=8.0)] = 2.0
        """Texels of that view along a pixel, 0.25 to 8."""
        coherent: Annotated[bool, Field(strict=True)] = False
        """Whether searches begin where they ended in the frame before."""
        levels: Annotated[int, Field(strict=True, ge=0, le=8)] = 0
        """Rounds in which triangles are divided where the mirror bends them, 0 to 8."""
        threshold: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0002
        """The error of an edge, 0 to 1, from which it is divided."""
        crack_free: Annotated[bool, Field(strict=True)] = True
        """Whether edges are divided by their own errors, so that no holes open between triangles."""

    config: Config

    def __init__(self, scene: DeviceScene, config: CommonConfig, tracer: SceneTracer) -> None:
        super().__init__(scene, config, tracer)
        self._texels: Texels = {}

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Search for the vertices of all objects in each reflector that is seen, and draw them there."""
        config, device, image = self.config, self.scene.device, VirtualImage(gbuffer, rays)
        stats.count("rays", rays.pixel.shape[0])
        with stats.stage("virtual", device):
            texels = self._texels if config.coherent else None
            rule = Subdivision(config.threshold, config.levels, config.crack_free)
            draw_bisected(image, gbuffer, TextureView(config.widening, config.fineness), rule, stats, texels)
        with stats.stage("shade", device):
            return image.reflected(shadow_tracer(self.tracer, self.scene, stats))
