"""Layered depth textures: C. Zhang, H.-H. Hsieh, H.-W. Shen, "Real-time Reflections on Curved Objects Using Layered
Depth Textures" (2008).

Each reflected object is peeled once into six orthographic maps with all its layers (sections 3.3 and 3.4). Reflection
regions on the reflectors are culled (section 3.2); the remaining pixels' rays are searched for in the maps.

    ldtrefl render scene.toml --method ldt --set resolution=256

The default search is our own (``tree.py``): it goes down a tree over the triangles, or over the texels where many
triangles share one. ``search=linear`` is the paper's.

Fails: ``search=linear`` misses what is thinner than a step or a texel, and its silhouettes are as coarse as texels;
``quality=fast`` loses a little at silhouettes.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.device.stats import Stats
from ldtrefl.frame.footprint import finest_footprints
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.kept import Followed
from ldtrefl.frame.reflect import BoundTracer, follow_rays, no_shadows, shade_gbuffer
from ldtrefl.frame.regions import Culled, CullTest, cull_rays, not_culled
from ldtrefl.ldt.exact.record_choice import Quality
from ldtrefl.ldt.resolution import resolutions_for
from ldtrefl.ldt.searches import TRACERS
from ldtrefl.ldt.texture import (
    BINARY_STEPS,
    DEFAULT_QUALITY,
    DEFAULT_RESOLUTION,
    FEWEST_TEXELS,
    TEXEL,
    BinarySteps,
    LayeredDepthTexture,
    LinearSteps,
    Resolution,
    peel_mesh,
)
from ldtrefl.methods.base import CONFIG, CommonConfig, Method, Reflection
from ldtrefl.scene.description import Camera
from ldtrefl.tracing.trace import array_of_views
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_scene import DeviceScene

FEW_OBJECTS = 8
"""Objects up to which culling takes as long as it saves: 4% more than without with two to five, 11% less with fifty."""

RESOLUTIONS_KEPT = 4
"""Of a mesh, maps of so many resolutions are kept when ``error`` chooses them: a camera that comes near and goes back
peels nothing twice. A frame uses exactly the resolutions that it asks for, whatever is kept, so that it has the bits of
a first frame; the price is to peel a mesh again where finer maps would have done."""

_Chosen = dict[DeviceMesh, LayeredDepthTexture | None]
"""Of each mesh the maps that a bounce searches; None where none are needed."""


class Ldt(Method):
    """Layered depth textures: rays searched for in six maps per object (Zhang, Hsieh and Shen)."""

    name = "ldt"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``ldt``."""

        resolution: Resolution | None = None
        """Texels along an object's longest side, 16 to 4096; 256 if neither this nor error is given."""
        error: Annotated[float, Field(gt=0.0, le=64.0)] | None = None
        """Pixels that reflected points and shadows may be off by: resolutions are chosen for what is seen."""
        search: Literal["exact", "linear"] = "exact"
        """How a ray is searched for: exact (down a tree over the surface), linear (the paper's)."""
        quality: Quality = DEFAULT_QUALITY
        """Of the exact search: exact (every triangle), balanced (texels where triangles are finer), fast (texels)."""
        linear_steps: LinearSteps = TEXEL
        """Samples of the linear search through an object's box: texel (one for each texel passed), or 1 to 100,000."""
        binary_steps: BinarySteps = BINARY_STEPS
        """Bisections of the step that crosses a surface."""
        cull: CullTest = "safe"
        """Reflection regions: safe (loses nothing), flat (the paper's, for flat mirror triangles)."""
        max_bounces: Annotated[int, Field(strict=True, ge=1, le=64)] | None = None
        """Reflections in reflections; the scene's number if not given."""

    def __init__(self, scene: DeviceScene, config: Any) -> None:
        super().__init__(scene, config)
        self._maps: dict[tuple[DeviceMesh, int, bool], LayeredDepthTexture] = {}
        """By mesh, resolution and whether they are trusted; those used last at the end."""
        self._bound: tuple[_Chosen, BoundTracer, list[Any]] | None = None
        """What the last tracer was made of, the tracer, and the views that own what it points to."""
        self._foreseen: tuple[GBuffer, dict[DeviceMesh, int]] | None = None
        """What was chosen for a frame when its shadows were asked for."""
        self._last: tuple[Camera, DeviceScene, Followed, dict[DeviceMesh, int]] | None = None
        """Of the last frame; the resolutions chosen for it."""
        self._has_moved = False
        """Whether any object has: what culling found then tells which rays are the same."""

    def shadow_tracer(self, gbuffer: GBuffer, stats: Stats) -> BoundTracer:
        """All objects' maps, as fine as the frame needs them for reflections, too."""
        self._foreseen = None
        self._drop_old_maps()
        chosen: dict[DeviceMesh, int] = {}
        if self._chooses:
            with stats.stage("cull", self.scene.device):
                rays = shade_gbuffer(gbuffer, no_shadows(self.scene.device)).rays
                # Counted when the rays themselves are culled.
                chosen = self._resolutions(gbuffer, rays, self._culled(gbuffer, rays, 0, Stats()))
            self._foreseen = gbuffer, chosen
        return self._bind({entry.index for entry in self.scene.objects}, chosen, stats)

    def reflect(self, gbuffer: GBuffer, rays: Any, stats: Stats) -> Reflection:
        """Cull, peel what is left on first need, march."""
        bounces = self.config.max_bounces or self.scene.scene.reflection.max_bounces
        with stats.stage("cull", self.scene.device):
            first = self._culled(gbuffer, rays, 0, stats)
            chosen = self._first_resolutions(gbuffer, rays, first)
        before, moved = self._before_of(gbuffer, chosen)
        at_first = dict(chosen)

        def cull(going: Any, bounce: int) -> Culled:
            if bounce == 0:
                return first
            culled = self._culled(gbuffer, going, bounce, stats)
            # A mesh that is seen in reflections of reflections, too, gets the finest maps that the frame has asked for.
            for mesh, texels in self._resolutions(gbuffer, going, culled).items():
                chosen[mesh] = max(texels, chosen.get(mesh, FEWEST_TEXELS))
            return culled

        def bind(needed: set[int]) -> BoundTracer:
            return self._bind(needed, chosen, stats)

        followed, hits = follow_rays(gbuffer, rays, cull, bind, bounces, self.skips, stats, before, moved)
        self._last = (gbuffer.camera, self.scene, followed, at_first) if gbuffer.is_whole else None
        self._drop_old_maps()
        meshes, made = {entry.geometry for entry in self.scene.objects}, {mesh for mesh, _, _ in self._maps}
        stats.counters["objects_skipped"] = len(meshes - made)
        return Reflection(followed.radiance, hits)

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved."""
        super().place(scene)
        self._has_moved = True

    def forget(self) -> None:
        """Drop the last frame's rays."""
        self._last = self._foreseen = None

    @property
    def _usual(self) -> int:
        """The resolution of maps that nothing is chosen for."""
        return self.config.resolution or DEFAULT_RESOLUTION

    @property
    def _chooses(self) -> bool:
        """Whether resolutions are chosen by what is seen."""
        return self.config.error is not None and self.config.resolution is None

    def _resolutions(self, gbuffer: GBuffer, rays: Any, culled: Culled) -> dict[DeviceMesh, int]:
        """What the rays of a bounce, and the shadows, need; nothing if all maps have the usual resolution."""
        if not self._chooses:
            return {}
        shadows = bool(self.scene.scene.lighting.shadows)
        footprints = finest_footprints(gbuffer, rays, culled, is_seen=shadows)
        return resolutions_for(self.config.error, self.config.search, self.scene, footprints)

    def _first_resolutions(self, gbuffer: GBuffer, rays: Any, culled: Culled) -> dict[DeviceMesh, int]:
        """What was foreseen for this frame, or else what its first rays need."""
        foreseen, self._foreseen = self._foreseen, None
        if foreseen is not None and foreseen[0] is gbuffer:
            return foreseen[1]
        return self._resolutions(gbuffer, rays, culled)

    def _key(self, mesh: DeviceMesh, chosen: dict[DeviceMesh, int]) -> tuple[DeviceMesh, int, bool]:
        """Which maps of a mesh are meant."""
        resolution = chosen.get(mesh, self._usual)
        # Coarser than usual they are trusted; at the usual resolution the exact search's patches are checked.
        trusted = resolution < self._usual
        return mesh, min(resolution, self._usual) if self.config.search == "exact" else resolution, trusted

    def _bind(self, needed: set[int], chosen: dict[DeviceMesh, int], stats: Stats) -> BoundTracer:
        """The tracer, once the maps of the objects in ``needed`` are peeled at the resolutions chosen."""
        maps = self._maps
        with stats.stage("peel", self.scene.device):
            for mesh in dict.fromkeys(self.scene.objects[index].geometry for index in sorted(needed)):
                key = self._key(mesh, chosen)
                if key not in maps:
                    maps[key] = self._peeled(*key, stats)
                maps[key] = maps.pop(key)  # used last
            # Whatever was peeled for other frames has no part in this one.
            current = {mesh: maps.get(self._key(mesh, chosen)) for mesh in self._meshes}
            if self._bound is None or self._bound[0] != current:
                self._bound = current, *self._tracer(current)
        return self._bound[1]

    @property
    def _meshes(self) -> dict[DeviceMesh, None]:
        """Every mesh once."""
        return dict.fromkeys(entry.geometry for entry in self.scene.objects)

    def _peeled(self, mesh: DeviceMesh, resolution: int, trusted: bool, stats: Stats) -> LayeredDepthTexture:
        config = self.config
        peeled = peel_mesh(mesh, resolution, quality=config.quality, search=config.search, trusted=trusted)
        stats.count("objects_from_cache" if peeled.from_cache else "objects_peeled", 1)
        stats.count("records", peeled.record_count)
        stats.count("map_bytes", peeled.nbytes)
        return peeled

    def _tracer(self, current: _Chosen) -> tuple[BoundTracer, list[Any]]:
        """The tracer of these maps, and the views that own what it points to."""
        tracer, search = TRACERS[self.config.search], self.config.search
        steps = {"linear_steps": self.config.linear_steps, "binary_steps": self.config.binary_steps}
        of_mesh = {}
        for mesh, maps in current.items():
            if maps is None:
                of_mesh[mesh] = tracer.view()
            else:
                of_mesh[mesh] = maps.view(search, **steps)
        views = [of_mesh[entry.geometry] for entry in self.scene.objects]
        return BoundTracer(tracer, array_of_views(views, tracer.view, self.scene.device)), list(of_mesh.values())

    def _drop_old_maps(self) -> None:
        """Of each mesh keep the maps at the ``RESOLUTIONS_KEPT`` that were used last."""
        count: dict[DeviceMesh, int] = {}
        for key in reversed(list(self._maps)):
            count[key[0]] = count.get(key[0], 0) + 1
            if count[key[0]] > RESOLUTIONS_KEPT:
                del self._maps[key]

    def _culled(self, gbuffer: GBuffer, rays: Any, bounce: int, stats: Stats) -> Culled:
        """Which objects the rays of a bounce can meet."""
        if not self.skips.regions or (self.config.cull == "safe" and not self._culling_pays()):
            return not_culled(self.scene)
        return cull_rays(gbuffer, rays, bounce, self.config.cull, stats)

    def _culling_pays(self) -> bool:
        """Not where all maps that can be needed are made, and few objects stand still: each ray tests their spheres
        as fast as a run of rays does."""
        if len(self.scene.objects) > FEW_OBJECTS or self._has_moved or self.config.error is not None:
            return True
        made = {entry.index for entry in self.scene.objects if self._key(entry.geometry, {}) in self._maps}
        return not not_culled(self.scene).shown <= made

    def _before_of(self, gbuffer: GBuffer, chosen: dict[DeviceMesh, int]) -> tuple[Followed | None, set[int]]:
        """The last frame's rays, if they were the same camera's in the same maps, and what has moved since; or nothing.

        A ray that is the same as then, and could not meet a mesh then, cannot now: only maps of both frames matter.
        """
        if self._last is None or not gbuffer.is_whole or not self.skips.frames:
            return None, set()
        camera, scene, followed, then = self._last
        if camera != gbuffer.camera or any(then[mesh] != chosen[mesh] for mesh in then.keys() & chosen.keys()):
            return None, set()
        moved = self.scene.moved_since(scene)
        return (None, set()) if moved is None else (followed, moved)
