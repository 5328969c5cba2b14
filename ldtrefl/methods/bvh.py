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

from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.reflect import BoundTracer, follow_rays
from ldtrefl.frame.regions import not_culled
from ldtrefl.methods.base import CONFIG, CommonConfig, Method, Reflection, Trees
from ldtrefl.world.device_scene import DeviceScene


class Bvh(Method):
    """Ray casting through a BVH over the triangles: the ground truth."""

    name = "bvh"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``bvh``."""

        max_bounces: Annotated[int, Field(strict=True, ge=1, le=64)] | None = None
        """Reflections in reflections; the scene's number if not given."""

    def __init__(self, scene: DeviceScene, config: Any) -> None:
        super().__init__(scene, config)
        self._trees = Trees()

    def shadow_tracer(self, gbuffer: GBuffer, stats: Stats) -> BoundTracer:
        """The BVH itself."""
        return self._trees.bound(self.scene, stats)

    def reflect(self, gbuffer: GBuffer, rays: Any, stats: Stats) -> Reflection:
        """Trace every reflected ray."""
        bounces = self.config.max_bounces or self.scene.scene.reflection.max_bounces
        everything = not_culled(self.scene)
        cull, bind = (lambda _rays, _bounce: everything), (lambda _objects: self._trees.bound(self.scene, stats))
        followed, hits = follow_rays(gbuffer, rays, cull, bind, bounces, self.skips, stats)
        return Reflection(followed.radiance, hits)
