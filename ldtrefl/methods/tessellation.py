"""Adaptive tessellation: A. Szabo, "Adaptive Tessellation in Screen Space Curved Reflections" (2013).

Vertices are placed by a search in image space (section 4.1), as ``bisector`` does it: from the middle of the reflector
to that texel of its position and normal maps at which the normal is nearest to the bisector. Triangles are divided
where what the mirror shows of an edge is not straight, in rounds, up to ``levels`` (section 4.2): an edge's error is
``E = 1 - (N . b + 1) / 2`` in its middle, and it is good enough below ``threshold``. The paper takes 0.01 to 0.1 for
perfectly acceptable; 0.01 is a normal that is 11 degrees off, which shows. A threshold of 0 divides every triangle up
to the last level, 1 none.

    ldtrefl render scene.toml --method tessellation --set levels=5 --set crack_free=true

By the paper's rule a triangle is divided into four or not at all, and holes open where it meets others (Fig. 10a). With
``crack_free`` an edge is divided by its own error alone, which both neighbours see alike: no hole is left.

Fails: as ``bisector`` does, but for coarse objects; with holes, unless ``crack_free``, which divides less in a round
and needs more levels. Where vertices have several reflections, on concave mirrors, one is shown (section 5.3), and what
fans out there is divided and divided again, which takes long and helps nothing.
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
from ldtrefl.methods.virtual.bisector_places import TextureView, draw_bisected
from ldtrefl.methods.virtual.image import VirtualImage
from ldtrefl.methods.virtual.subdivision import Subdivision
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.ray_buffers import RayBuffer


class Tessellation(RayMethod):
    """As bisector, and triangles divided where the mirror bends them: for coarse objects in smooth convex mirrors."""

    name = "tessellation"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``tessellation``."""

        widening: Annotated[float, Field(ge=1.0, le=8.0)] = 1.25
        """How many times as wide as the image the view is in which the reflector is searched, 1 to 8."""
        fineness: Annotated[float, Field(ge=0.25, le=8.0)] = 2.0
        """Texels of that view along a pixel, 0.25 to 8."""
        levels: Annotated[int, Field(strict=True, ge=0, le=8)] = 5
        """Rounds in which triangles are divided where the mirror bends them, 0 to 8."""
        threshold: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0002
        """The error of an edge, 0 to 1, from which it is divided."""
        crack_free: Annotated[bool, Field(strict=True)] = False
        """Whether edges are divided by their own errors, so that no holes open between triangles."""

    config: Config

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Search for the vertices of all objects in each reflector that is seen, and draw them there."""
        config, device, image = self.config, self.scene.device, VirtualImage(gbuffer, rays)
        stats.count("rays", rays.pixel.shape[0])
        with stats.stage("virtual", device):
            rule = Subdivision(config.threshold, config.levels, config.crack_free)
            draw_bisected(image, gbuffer, TextureView(config.widening, config.fineness), rule, stats)
        with stats.stage("shade", device):
            return image.reflected(shadow_tracer(self.tracer, self.scene, stats))
