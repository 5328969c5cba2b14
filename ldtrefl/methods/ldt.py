"""Layered depth textures: C. Zhang, H.-H. Hsieh, H.-W. Shen, "Real-time Reflections on Curved Objects Using Layered
Depth Textures" (2008).

Each reflected object is peeled once into six orthographic maps with all its layers (sections 3.3 and 3.4). Reflection
regions on the reflectors are culled (section 3.2); the remaining pixels' rays are searched for in the maps.

    ldtrefl render scene.toml --method ldt --set resolution=256

The default search is our own (``ldt/exact/tree.py``): it goes down a tree over the triangles, or over the texels where
many triangles share one. ``search=linear`` is the paper's. In meshes whose triangles are many and small in the image
the exact search answers the camera's rays, too (``frame/search_choice.py``).

Fails: ``search=linear`` misses what is thinner than a step or a texel, and its silhouettes are as coarse as texels;
``quality=fast`` loses a little at silhouettes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Annotated, Literal

import numpy as np
import warp as wp
from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.device.stats import Stats
from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.bounces import BounceLimits, RayFollower, summed_by_pixel
from ldtrefl.frame.camera_shading import first_rays
from ldtrefl.frame.first_frame import kernels_of_rays
from ldtrefl.frame.flat_regions import flat_regions
from ldtrefl.frame.footprint import finest_footprints
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.frame.refollow import followed_with_history
from ldtrefl.frame.regions import (
    FEW_OBJECTS,
    Regions,
    all_objects,
    cull_runs,
    objects_that_rays_meet,
    safe_regions,
)
from ldtrefl.frame.sample_points import SamplePoints
from ldtrefl.frame.search_choice import large_objects_in_view, objects_to_search
from ldtrefl.frame.searched_pixels import CameraSearch
from ldtrefl.ldt.exact.build import KERNELS as TREE_KERNELS
from ldtrefl.ldt.options import (
    BINARY_STEPS,
    DEFAULT_QUALITY,
    FEWEST_TEXELS,
    TEXEL,
    BinarySteps,
    LinearSteps,
    Quality,
    Resolution,
)
from ldtrefl.ldt.resolution import resolutions_for
from ldtrefl.ldt.scene_maps import MapOptions, SceneMaps
from ldtrefl.ldt.searches import TRACERS
from ldtrefl.methods.base import CONFIG, CommonConfig, RayConfig, RayMethod
from ldtrefl.scene.description import Camera
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.scene_bvh import SceneBvh
from ldtrefl.tracing.tracer import BoundTracer, SceneTracer
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_scene import DeviceScene


class Ldt(RayMethod):
    """Layered depth textures (Zhang, Hsieh, Shen): as right as ray casting, fast on heavy meshes; the one to choose."""

    name = "ldt"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(RayConfig):
        """Options of ``ldt``."""

        resolution: Resolution | None = None
        """Texels along an object's longest side, 16 to 4096; 256 if neither this nor error is given."""
        error: Annotated[float, Field(gt=0.0, le=64.0)] | None = None
        """Pixels that reflected points and shadows may be off by: resolutions are chosen for what is seen. The camera's
        own rays are then never searched for, and all triangles drawn."""
        search: Literal["exact", "linear"] = "exact"
        """How a ray is searched for: exact (down a tree over the surface; the camera's rays, too, in meshes whose
        triangles are many and small in the image), linear (the paper's)."""
        quality: Quality = DEFAULT_QUALITY
        """Of the exact search: exact (every triangle), balanced (texels where triangles are finer), fast (texels).
        Mirrors, and meshes that the camera's rays are searched for in, are always exact."""
        linear_steps: LinearSteps = TEXEL
        """Samples of the linear search through an object's box: texel (one for each texel passed), or 1 to 100,000."""
        binary_steps: BinarySteps = BINARY_STEPS
        """Bisections of the step that crosses a surface."""
        cull: Literal["safe", "flat"] = "safe"
        """Reflection regions: safe (loses nothing), flat (the paper's, for flat mirror triangles)."""

    config: Config
    tracer: SceneMaps

    def __init__(self, scene: DeviceScene, config: CommonConfig, tracer: SceneTracer) -> None:
        super().__init__(scene, config, tracer)
        self._has_moved = False
        """Whether any object has moved. Culling then pays: it tells which rays of the last frame serve again."""
        self._caster = SceneBvh()
        """Sees what the camera does between the pixels' centres, if the maps have not every triangle."""

    @classmethod
    def scene_tracer(cls, config: CommonConfig) -> SceneTracer:
        """The maps of all objects."""
        assert isinstance(config, Ldt.Config)
        options = MapOptions(config.search, config.quality, config.linear_steps, config.binary_steps, config.resolution)
        return SceneMaps(options)

    @classmethod
    def needs_footprints(cls, config: CommonConfig) -> bool:
        """Resolutions are chosen by footprints."""
        assert isinstance(config, Ldt.Config)
        return config.error is not None and config.resolution is None

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved."""
        super().place(scene)
        self._has_moved = True

    def first_kernels(self) -> list[wp.Kernel]:
        """What searches for the rays, and what peels for the usual search."""
        of_rays = kernels_of_rays(self.scene, TRACERS[self.config.search], self.skip)
        return [*of_rays, *(TREE_KERNELS if self.config.search == "exact" else ()), cull_runs]

    def camera_search(self, scene: DeviceScene, camera: Camera, stats: Stats) -> CameraSearch | None:
        """Meshes whose triangles are many and small in the image are searched by the exact search, unless maps are to
        be as coarse as an error allows."""
        numbers = np.zeros(0, np.int64)
        if self._traces_exactly:
            numbers = objects_to_search(scene, camera)
        sampled = numbers
        if self._traces_exactly and self.config.sampling(scene.scene).samples > 1:
            # Samples between the pixels' centres are searched for, too, and must see meshes as they are drawn.
            sampled = np.union1d(numbers, large_objects_in_view(scene, camera))
        self.tracer.searched_by_camera = frozenset(scene.meshes[k] for k in np.unique(scene.mesh_of[sampled]))
        if not len(numbers):
            return None
        return CameraSearch(numbers, self.tracer.bound(scene, numbers.tolist(), stats))

    def sample_tracer(self, scene: DeviceScene, objects: Collection[int], stats: Stats) -> BoundTracer:
        """The maps, where they have every triangle; else the ray caster."""
        if self._traces_exactly:
            return self.tracer.bound(scene, objects, stats)
        return self._caster.bound(scene, objects, stats)

    def foresee(self, gbuffer: GBuffer, stats: Stats) -> None:
        """Choose maps for the frame's shadows that are as fine as its reflections need them, too."""
        self.tracer.chosen = {}
        self.tracer.drop_old_maps()
        if self._chooses:
            with stats.stage("cull", self.scene.device):
                rays = first_rays(gbuffer)
                # Counted when the rays themselves are culled.
                self.tracer.chosen = self._resolutions(gbuffer, rays, self._culled(gbuffer, rays, 0, Stats()))

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Cull, peel what is left on first need, march."""
        limits = self.config.limits(self.scene.scene)
        follower = RayFollower(gbuffer, self, limits, self.skip, stats, self.keeps_bounces)
        regions = follower.first_regions(rays)
        chosen = dict(self.tracer.chosen)
        serving = reusable if self._serves_again(reusable, follower.limits) else None
        followed = followed_with_history(follower, rays, regions, serving)
        self.tracer.drop_old_maps()
        stats.counters["objects_skipped"] = self.tracer.meshes_without_maps(self.scene)
        radiance = summed_by_pixel(gbuffer.reflector_pixels, rays, followed.radiance)
        first_hits = FirstHits.of(gbuffer, followed)
        return ReflectedLight(radiance, first_hits, followed, chosen, self.tracer.searched_by_camera)

    def regions(self, gbuffer: GBuffer, rays: RayBuffer, bounce: int, stats: Stats) -> Regions:
        """Cull the rays of a bounce, and choose how fine the maps must be that they are searched for in."""
        regions = self._culled(gbuffer, rays, bounce, stats)
        if isinstance(gbuffer, SamplePoints):
            return regions  # the maps are those of the pixels that they lie about
        if bounce == 0:
            if not self.scene.scene.lighting.is_traced:  # shadows have chosen already (``foresee``)
                self.tracer.chosen = self._resolutions(gbuffer, rays, regions)
            return regions
        # A mesh that is seen in reflections of reflections, too, gets the finest maps that the frame has asked for.
        finest = dict(self.tracer.chosen)
        for mesh, texels in self._resolutions(gbuffer, rays, regions).items():
            finest[mesh] = max(texels, finest.get(mesh, FEWEST_TEXELS))
        self.tracer.chosen = finest
        return regions

    def traced(self, objects: set[int], stats: Stats) -> BoundTracer:
        """The maps of these objects, peeled on first need."""
        return self.tracer.bound(self.scene, objects, stats)

    def _serves_again(self, reusable: Reusable | None, limits: BounceLimits) -> bool:
        """Whether the last frame's answer was made with the same maps as this one's.

        A ray that has not changed meets no mesh that it could not meet then. So only the maps of meshes that are in
        both frames must be the same.
        """
        if reusable is None or (self._chooses and limits.most > 1):
            return False
        if reusable.reflected.searched_by_camera != self.tracer.searched_by_camera:
            return False
        then, chosen = reusable.reflected.resolutions, self.tracer.chosen
        return all(then[mesh] == chosen[mesh] for mesh in then.keys() & chosen.keys())

    @property
    def _traces_exactly(self) -> bool:
        """Whether the camera's rays may be searched for in the maps."""
        return self.config.search == "exact" and not self._chooses

    @property
    def _chooses(self) -> bool:
        """Whether resolutions are chosen by what is seen."""
        return self.needs_footprints(self.config)

    def _resolutions(self, gbuffer: GBuffer, rays: RayBuffer, regions: Regions) -> Mapping[DeviceMesh, int]:
        """The resolutions that the rays of a bounce and the shadows need; empty if all maps have the usual one."""
        if self.config.error is None or not self._chooses:
            return {}
        footprints = finest_footprints(gbuffer, rays, regions, is_seen=self.scene.scene.lighting.is_traced)
        return resolutions_for(self.config.error, self.config.search, self.scene, footprints)

    def _culled(self, gbuffer: GBuffer, rays: RayBuffer, bounce: int, stats: Stats) -> Regions:
        """Which objects the rays of a bounce can meet."""
        is_flat = self.config.cull == "flat"
        if not self.skip.regions or (is_flat and bounce > 0) or (not is_flat and not self._culling_pays(rays)):
            return all_objects(self.scene, rays)
        return flat_regions(gbuffer, rays, stats) if is_flat else safe_regions(gbuffer, rays, bounce, stats)

    def _culling_pays(self, rays: RayBuffer) -> bool:
        """Whether culling saves more than it costs. It does not where all maps that can be needed are made and a few
        objects stand still: to test each ray against their spheres is then as fast as to test runs of rays."""
        if len(self.scene.objects) > FEW_OBJECTS or self._has_moved or self.config.error is not None:
            return True
        return not self.tracer.has_usual_maps(self.scene, objects_that_rays_meet(self.scene, rays))
