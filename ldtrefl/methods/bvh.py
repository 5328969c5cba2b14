"""Ray casting through a BVH: the ground truth.

Per reflector pixel the mirror direction of the interpolated normal, the closest hit over all objects, shaded; the
environment on a miss; and on from there where it meets a mirror.

    ldtrefl render scene.toml --method bvh

Fails: nowhere, as far as the scene's triangles go. Its cost grows with their number, and a mesh whose vertices change
needs a new tree.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.stats import Stats
from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.bounces import RayFollower, summed_by_pixel
from ldtrefl.frame.first_frame import kernels_of_rays
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.frame.refollow import followed_with_history
from ldtrefl.frame.regions import FEW_OBJECTS, Regions, all_objects, safe_regions
from ldtrefl.methods.base import RayConfig, RayMethod
from ldtrefl.tracing.bvh import BVH
from ldtrefl.tracing.bvh_walk import box_triangles
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.tracer import BoundTracer


class Bvh(RayMethod):
    """Ray casting through a BVH over the triangles: the ground truth, to compare with."""

    name = "bvh"

    Config = RayConfig
    config: RayConfig

    def first_kernels(self) -> list[wp.Kernel]:
        """What casts the rays, and builds their trees."""
        return [*kernels_of_rays(self.scene, BVH, self.skip), box_triangles]

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Trace the reflected rays; while the camera stays, those that may end elsewhere than in the last frame."""
        limits = self.config.limits(self.scene.scene)
        follower = RayFollower(gbuffer, self, limits, self.skip, stats, self.keeps_bounces)
        followed = followed_with_history(follower, rays, follower.first_regions(rays), reusable)
        radiance = summed_by_pixel(gbuffer.reflector_pixels, rays, followed.radiance)
        return ReflectedLight(radiance, FirstHits.of(gbuffer, followed), followed)

    def regions(self, gbuffer: GBuffer, rays: RayBuffer, bounce: int, stats: Stats) -> Regions:
        """Every ray may meet every object; of many, what it cannot meet is left out."""
        if len(self.scene.objects) > FEW_OBJECTS:
            return safe_regions(gbuffer, rays, bounce, stats)
        return all_objects(self.scene, rays)

    def traced(self, objects: set[int], stats: Stats) -> BoundTracer:
        """The BVHs of all objects."""
        return self.tracer.bound(self.scene, objects, stats)
