"""Ray casting through a BVH: the ground truth.

Per reflector pixel the mirror direction of the interpolated normal, the closest hit over all other objects, shaded;
the environment on a miss.

    ldtrefl render scene.toml --method bvh

Fails: nowhere that the scene's triangles can tell; its cost grows with them, and a mesh that moves needs a new tree.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.cull import not_culled
from ldtrefl.gbuffer import GBuffer
from ldtrefl.launch import Stats
from ldtrefl.methods.base import CONFIG, CommonConfig, Method, Reflection
from ldtrefl.raycast import BVH, BvhView, Raycaster
from ldtrefl.reflect import BoundTracer, follow_rays
from ldtrefl.trace import array_of_views


class Bvh(Method):
    """Ray casting through a BVH over the triangles: the ground truth."""

    name = "bvh"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``bvh``."""

        max_bounces: Annotated[int, Field(strict=True, ge=1, le=64)] | None = None
        """Reflections in reflections; the scene's number if not given."""

    def _bind(self, stats: Stats) -> BoundTracer:
        if not hasattr(self, "_bound"):
            with stats.stage("build", self.scene.device):
                self._trees: dict[int, Raycaster] = {}
                for entry in self.scene.objects:
                    if id(entry.geometry) not in self._trees:
                        self._trees[id(entry.geometry)] = Raycaster.of(entry.geometry)
                views = [self._trees[id(entry.geometry)].view() for entry in self.scene.objects]
                self._bound = BoundTracer(BVH, array_of_views(views, BvhView, self.scene.device))
        return self._bound

    def shadow_tracer(self, stats: Stats) -> BoundTracer:
        """The BVH itself."""
        return self._bind(stats)

    def reflect(self, gbuffer: GBuffer, rays: Any, stats: Stats) -> Reflection:
        """Trace every reflected ray."""
        bounces = self.config.max_bounces or self.scene.scene.reflection.max_bounces
        everything = not_culled(self.scene)
        cull, bind = (lambda _rays, _bounce: everything), (lambda _objects: self._bind(stats))
        followed, hits = follow_rays(gbuffer, rays, cull, bind, bounces, self.skips, stats)
        return Reflection(followed.radiance, hits)
