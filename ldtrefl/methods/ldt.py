"""Layered depth textures: C. Zhang, H.-H. Hsieh, H.-W. Shen, "Real-time Reflections on Curved Objects Using Layered
Depth Textures" (2008).

Each reflected object is peeled once into six orthographic maps with all its layers (sections 3.3 and 3.4). Reflection
regions on the reflectors are culled (section 3.2); the remaining pixels' rays are searched for in the maps.

    ldtrefl render scene.toml --method ldt --set resolution=256

The default search is our own (``grid.py``): it walks the occupied cells and tests the triangles in them, or the texels
where many triangles share one. ``search=linear`` is the paper's.

Fails: ``search=linear`` misses what is thinner than a step or a texel, and its silhouettes are as coarse as texels;
``quality=fast`` loses a little at silhouettes.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.cull import Culled, CullTest, cull_rays, not_culled
from ldtrefl.device_scene import DeviceScene
from ldtrefl.gbuffer import GBuffer
from ldtrefl.grid_build import Quality
from ldtrefl.kept import Followed
from ldtrefl.launch import Stats
from ldtrefl.ldt import (
    BINARY_STEPS,
    DEFAULT_QUALITY,
    DEFAULT_RESOLUTION,
    LINEAR_STEPS,
    LayeredDepthTexture,
    peel_mesh,
)
from ldtrefl.march import TRACERS
from ldtrefl.methods.base import CONFIG, CommonConfig, Method, Reflection
from ldtrefl.reflect import BoundTracer, follow_rays
from ldtrefl.resolution import LARGEST, SMALLEST, resolutions_for
from ldtrefl.scene import Camera
from ldtrefl.trace import array_of_views

FEW_OBJECTS = 8
"""Objects up to which culling takes as long as it saves: 4% more than without with two to five, 11% less with fifty."""


class Ldt(Method):
    """Layered depth textures: rays searched for in six maps per object (Zhang, Hsieh and Shen)."""

    name = "ldt"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``ldt``."""

        resolution: Annotated[int, Field(strict=True, ge=SMALLEST, le=LARGEST)] | None = None
        """Texels along an object's longest side, 16 to 4096; 256 if neither this nor error is given."""
        error: Annotated[float, Field(gt=0.0, le=64.0)] | None = None
        """Pixels that reflected points may be off by: each object's resolution is chosen for what is seen of it."""
        search: Literal["exact", "linear"] = "exact"
        """How a ray is searched for: exact (a walk through occupied cells), linear (the paper's)."""
        quality: Quality = DEFAULT_QUALITY
        """Of the exact search: exact (every triangle), balanced (texels where triangles are finer), fast (texels)."""
        linear_steps: Annotated[int, Field(strict=True, ge=1, le=100_000)] = LINEAR_STEPS
        """Steps of the linear search through an object's box."""
        binary_steps: Annotated[int, Field(strict=True, ge=0, le=64)] = BINARY_STEPS
        """Bisections of the step that crosses a surface."""
        cull: CullTest = "safe"
        """Reflection regions: safe (loses nothing), flat (the paper's, for flat mirror triangles)."""
        max_bounces: Annotated[int, Field(strict=True, ge=1, le=64)] | None = None
        """Reflections in reflections; the scene's number if not given."""

    def __init__(self, scene: DeviceScene, config: Any) -> None:
        super().__init__(scene, config)
        self._maps: dict[int, LayeredDepthTexture] = {}
        """By ``id`` of the mesh on the device."""
        self._last: tuple[Camera, DeviceScene, Followed] | None = None
        """Of the last frame."""
        self._has_moved = False
        """Whether any object has: what culling found then tells which rays are the same."""

    def _bind(self, needed: set[int], stats: Stats, resolutions: dict[int, int] | None = None) -> BoundTracer:
        """The tracer, once the maps of the objects in ``needed`` are peeled, at these resolutions or finer."""
        maps = self._maps
        quality, search = self.config.quality, self.config.search
        with stats.stage("peel", self.scene.device):
            for index in sorted(needed):
                geometry = self.scene.objects[index].geometry
                usual = self.config.resolution or DEFAULT_RESOLUTION
                resolution = resolutions.get(index, usual) if resolutions else usual
                # Coarser than usual they are trusted; at the usual resolution the exact search's patches are checked.
                trusted = resolution < usual
                resolution = min(resolution, usual) if search == "exact" else resolution
                if id(geometry) in maps and maps[id(geometry)].resolution >= resolution:
                    continue
                peeled = peel_mesh(geometry, resolution, quality=quality, search=search, trusted=trusted)
                maps[id(geometry)] = peeled
                stats.count("objects_from_cache" if peeled.from_cache else "objects_peeled", 1)
                stats.count("records", peeled.record_count)
                stats.count("map_bytes", peeled.nbytes)
        tracer = TRACERS[search]
        steps = {"linear_steps": self.config.linear_steps, "binary_steps": self.config.binary_steps}
        views = []
        for entry in self.scene.objects:
            if id(entry.geometry) not in maps:
                views.append(tracer.view())
            elif search == "exact" and not self.skips.leaps:
                views.append(maps[id(entry.geometry)].grid.view_without_leaps)
            else:
                views.append(maps[id(entry.geometry)].view(search, **steps))
        return BoundTracer(tracer, array_of_views(views, tracer.view, self.scene.device))

    def shadow_tracer(self, stats: Stats) -> BoundTracer:
        """All objects' maps."""
        return self._bind({entry.index for entry in self.scene.objects}, stats)

    def reflect(self, gbuffer: GBuffer, rays: Any, stats: Stats) -> Reflection:
        """Cull, peel what is left on first need, march."""
        bounces = self.config.max_bounces or self.scene.scene.reflection.max_bounces

        resolutions: dict[int, int] = {}

        def cull(going: Any, bounce: int) -> Culled:
            if not self.skips.regions or (self.config.cull == "safe" and not self._culling_pays()):
                culled = not_culled(self.scene)
            else:
                culled = cull_rays(gbuffer, going, bounce, self.config.cull, stats)
            error, search = self.config.error, self.config.search
            if error is not None and self.config.resolution is None:
                width = gbuffer.camera.width
                resolutions.update(resolutions_for(error, search, self.scene, width, going, culled))
            return culled

        def bind(needed: set[int]) -> BoundTracer:
            return self._bind(needed, stats, resolutions)

        before, moved = self._before_of(gbuffer)
        followed, hits = follow_rays(gbuffer, rays, cull, bind, bounces, self.skips, stats, before, moved)
        self._last = (gbuffer.camera, self.scene, followed)
        meshes = {id(entry.geometry) for entry in self.scene.objects}
        stats.count("objects_skipped", len(meshes) - len(self._maps))
        return Reflection(followed.radiance, hits)

    def _culling_pays(self) -> bool:
        """Not where all maps that can be needed are made, and few objects stand still: each ray tests their spheres
        as fast as a run of rays does."""
        can_be_needed = not_culled(self.scene).shown
        made = {entry.index for entry in self.scene.objects if id(entry.geometry) in self._maps}
        tells_more = self._has_moved or self.config.error is not None
        return len(self.scene.objects) > FEW_OBJECTS or tells_more or not can_be_needed <= made

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved."""
        super().place(scene)
        self._has_moved = True

    def _before_of(self, gbuffer: GBuffer) -> tuple[Followed | None, set[int]]:
        """The last frame's rays, if they were the same camera's, and what has moved since; or nothing."""
        if self._last is None or self._last[0] != gbuffer.camera or not self.skips.frames:
            return None, set()
        moved = self.scene.moved_since(self._last[1])
        return (None, set()) if moved is None else (self._last[2], moved)
