"""Environment mapping: one cube map per reflector, drawn from its centre without it, in which reflected rays are looked
up. J. F. Blinn, M. E. Newell, "Texture and Reflection in Computer Generated Images" (1976); as a cube map, N. Greene
(1986). The baseline that every paper compares with, and what was made of it since.

    ldtrefl render scene.toml --method envmap --set resolution=512 --set projection=layered

``projection`` says what a ray, which starts at x in direction R seen from the map's centre, is looked up by:

- ``infinite``: R alone. Fails: everything is taken to be infinitely far away, so near objects are reflected in the
  wrong place and size, and contact shows a gap.
- ``sphere``: where the ray leaves a sphere about the centre (Bjorke 2004, GPU Gems, chapter 19;
  ``cube_maps/proxies.py``). Its ``radius`` is measured (``cube_maps/surroundings.py``) if it is not given. Exact in a
  spherical room. Fails: all is taken to be equally far.
- ``box``: where it leaves a box along the world's axes (Behc 2010; Lagarde and Zanuttini 2012), measured as well. Exact
  in a room that is a box with nothing in it. Fails: what stands in the room is painted on its walls, and so is the
  environment where a side is partly open. Under an open sky sphere and box can be worse than ``infinite``.
- ``distance``: where a search by secants in a map of distances ends (Szirmay-Kalos, Aszodi, Lazanyi and Premecz 2005;
  ``cube_maps/impostor.py`` has the equations). Fails: what the centre does not see is nowhere, the search may pass a
  small object or end on one that the ray passes, and silhouettes are torn. A part of the reflector that is behind what
  the centre sees is looked up by R alone.
- ``layered``: the first place that a linear search and then secants find along the ray in two layers of distances, all
  that the centre sees and what stands behind it (Umenhoffer, Patow and Szirmay-Kalos 2007, GPU Gems 3, chapter 17;
  ``cube_maps/layers.py``). Fails: what stands behind two surfaces is not there, surfaces that the centre sees edge-on
  have holes, and what is smaller than some texels may be passed. A search takes as long as tens of look-ups.

All of them: silhouettes and textures are as coarse as the map's texels. A reflector does not show itself, and other
reflectors show the environment alone: no ray is reflected twice. Surfaces are lit as the centre sees them: what it sees
from behind is shown so to all rays, and so are highlights and what a mirror shows. Where backs are not there, or alpha
cuts a surface out, the environment is seen, whatever stands behind. A light with a shape is part of the map, in both
layers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import warp as wp
from pydantic import Field
from pydantic.dataclasses import dataclass as pydantic_dataclass

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.bounces import summed_by_pixel
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.methods.base import CONFIG, CommonConfig, RayMethod
from ldtrefl.methods.cube_maps.drawing import Drawn, draw_layers
from ldtrefl.methods.cube_maps.faces import CubeLayer, look_up
from ldtrefl.methods.cube_maps.impostor import reflect_distances
from ldtrefl.methods.cube_maps.layers import reflect_layers
from ldtrefl.methods.cube_maps.proxies import reflect_box, reflect_sphere
from ldtrefl.methods.cube_maps.surroundings import Surroundings, reach_of
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.tracer import SceneTracer
from ldtrefl.world.device_object import DeviceObject
from ldtrefl.world.device_scene import DeviceScene


@launch.kernel
def reflect_cube(
    first: int,
    # In:
    rays: RayBuffer,
    reflector: int,
    cube: wp.array(dtype=wp.vec3),
    resolution: int,
    # Out:
    radiance_out: wp.array(dtype=wp.vec3),
):
    """Look up what one ray brings, if it leaves this reflector."""
    i = first + wp.tid()
    if rays.source[i] == reflector:
        radiance_out[i] = look_up(cube, resolution, rays.direction[i])


@dataclass(frozen=True, eq=False)
class CubeMap:
    """A reflector's cube map, and how rays are looked up in it."""

    layers: list[CubeLayer]
    kernel: wp.Kernel
    inputs: list[object]
    """What the kernel takes beside the rays, the reflector's number and the radiance."""


class EnvironmentMap(RayMethod):
    """A cube map from each reflector's centre: the classic baseline, for far surroundings; near ones by projection."""

    name = "envmap"

    @pydantic_dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``envmap``."""

        resolution: Annotated[int, Field(strict=True, ge=1, le=4096)] = 512
        """Pixels along a side of each face, 1 to 4096."""
        projection: Literal["infinite", "sphere", "box", "distance", "layered"] = "infinite"
        """What a ray is looked up by: infinite (its direction), sphere or box (where it leaves one that stands for all
        around), distance (a search in a map of distances), layered (in two of them, one behind the other)."""
        radius: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
        """Of the sphere about a reflector's centre, in the world's units; measured from the cube map if not given."""

        def __post_init__(self) -> None:
            if self.radius is not None and self.projection != "sphere":
                raise InputError(f"radius: only projection=sphere has one, got projection={self.projection}")

    config: Config

    def __init__(self, scene: DeviceScene, config: CommonConfig, tracer: SceneTracer) -> None:
        super().__init__(scene, config, tracer)
        self._cubes: dict[int, CubeMap] = {}
        """The cube maps, by number of the reflector."""
        self._up: tuple[float, ...] = ()
        """The direction of the environment's top when they were drawn."""
        self._cubes_taken = 0
        """The number of cube maps that memory has been asked for."""

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved: every cube map may show them."""
        super().place(scene)
        self._cubes.clear()

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Draw the cube maps on first need, then look up every ray."""
        device, count = self.scene.device, rays.pixel.shape[0]
        radiance = wp.zeros(count, dtype=wp.vec3, device=device)
        stats.count("rays", count)
        seen = set(np.unique(rays.source.numpy()).tolist())
        up = tuple(self.scene.lighting.up)
        if up != self._up:
            # The environment stands up with the camera: every cube map shows it.
            self._cubes.clear()
            self._up = up
        self._take_memory(len(seen - self._cubes.keys()))
        for entry in self.scene.reflectors:
            if entry.index not in seen:
                continue
            if entry.index not in self._cubes:
                self._cubes[entry.index] = self._made(entry, stats)
            with stats.stage("shade", device):
                cube = self._cubes[entry.index]
                launch.launch(cube.kernel, count, [rays, entry.index, *cube.inputs, radiance], device)
        return ReflectedLight(summed_by_pixel(gbuffer.reflector_pixels, rays, radiance))

    @property
    def _drawn(self) -> Drawn:
        """What is drawn of each cube map."""
        projection = self.config.projection
        return Drawn(self.config.resolution, 2 if projection == "layered" else 1, projection != "infinite")

    def _take_memory(self, cubes: int) -> None:
        """Ask for what so many more cube maps need, once for each reflector."""
        if cubes > self._cubes_taken:
            side, drawn = self.config.resolution, self._drawn
            what = f"{cubes} cube maps of 6 x {side} x {side} pixels"
            budget.take(drawn.bytes * cubes + drawn.working_bytes, what, "resolution")
            self._cubes_taken = cubes

    def _made(self, reflector: DeviceObject, stats: Stats) -> CubeMap:
        """The cube map about a reflector's centre."""
        shadow = shadow_tracer(self.tracer, self.scene, stats)
        behind = shadow
        if self._drawn.layers > 1:
            behind = self.tracer.bound(self.scene, range(len(self.scene.objects)), stats)
        with stats.stage("cubemap", self.scene.device):
            layers = draw_layers(self._drawn, self.scene, reflector, shadow, behind, self.skip.bounds)
            return self._looked_up(layers, reflector)

    def _looked_up(self, layers: list[CubeLayer], reflector: DeviceObject) -> CubeMap:
        """How rays are looked up in what was drawn."""
        projection, side, centre = self.config.projection, self.config.resolution, wp.vec3d(*reflector.centre)
        flat = [layers[0].radiance, side]
        if projection == "infinite":
            return CubeMap(layers, reflect_cube, flat)
        if projection in ("distance", "layered"):
            reach = max(reach_of(layer.nearness.numpy(), side) for layer in layers)
            kernel = reflect_distances if projection == "distance" else reflect_layers
            return CubeMap(layers, kernel, [*layers, side, centre, reach, self.scene.lighting])
        if projection == "sphere" and self.config.radius is not None:
            return CubeMap(layers, reflect_sphere, [*flat, centre, self.config.radius * self._scale])
        around = Surroundings.of(layers[0].nearness.numpy(), side, *self._own_box(reflector))
        if projection == "sphere":
            return CubeMap(layers, reflect_sphere, [*flat, centre, around.radius])
        return CubeMap(layers, reflect_box, [*flat, centre, wp.vec3(*around.low), wp.vec3(*around.high)])

    @property
    def _scale(self) -> float:
        return self.scene.device_units_per_world_unit

    def _own_box(self, reflector: DeviceObject) -> tuple[np.ndarray, np.ndarray]:
        """(3,) corners of the box along the axes about a reflector, relative to its centre, in device units."""
        mesh = reflector.geometry.mesh
        points = mesh.unit_vertices[mesh.is_used] @ (self._scale * reflector.world_from_unit[:3, :3].T)
        return points.min(axis=0), points.max(axis=0)
