"""Environment mapping: J. F. Blinn, M. E. Newell, "Texture and Reflection in Computer Generated Images" (1976);
as a cube map, N. Greene (1986). The baseline that every paper compares with.

One cube map per reflector, drawn from its centre without it, looked up by the reflected direction alone.

    ldtrefl render scene.toml --method envmap --set resolution=512

Fails: everything is taken to be infinitely far away, so near objects are reflected in the wrong place and size, and
contact shows a gap.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import warp as wp
from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.bounces import summed_by_pixel
from ldtrefl.frame.camera_shading import shade_gbuffer
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.frame.visibility import draw_in_bands
from ldtrefl.geometry.bilinear import bilinear_blend, neighbours_clamped
from ldtrefl.methods.base import CONFIG, CommonConfig, RayMethod
from ldtrefl.scene.description import Camera
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.tracer import SceneTracer
from ldtrefl.world.device_object import DeviceObject
from ldtrefl.world.device_scene import DeviceScene

PIXEL_BYTES = 12
"""Bytes of a pixel of a cube map."""

LEAST_DEPTH = wp.constant(0.5)
"""The least component that a direction is taken to have along the axis of its face. A unit vector has 0.577 or more;
the direction to what the eye touches is 0."""

LEAST_SIZE = 1e-6
"""A cube map's camera looks at a point at least this far from the reflector's centre, as a share of the centre's
largest coordinate: a nearer point would be rounded to the centre."""


@wp.func
def cube_face(direction: wp.vec3) -> int:
    """The face 0..5 = +x, -x, +y, -y, +z, -z that a direction points to."""
    axis = int(0)
    if wp.abs(direction[1]) > wp.abs(direction[axis]):
        axis = 1
    if wp.abs(direction[2]) > wp.abs(direction[axis]):
        axis = 2
    if direction[axis] < 0.0:
        return 2 * axis + 1
    return 2 * axis


@wp.func
def look_up(cube: wp.array(dtype=wp.vec3), resolution: int, direction: wp.vec3) -> wp.vec3:
    """Bilinear radiance of a cube map in a unit direction; samples beyond a face's edge are its border's."""
    face = cube_face(direction)
    # The face's camera: forward along its axis, up +z, or +y for the faces of z.
    forward = wp.vec3(0.0)
    forward[face / 2] = wp.where(face % 2 == 0, 1.0, -1.0)
    up = wp.where(face >= 4, wp.vec3(0.0, 1.0, 0.0), wp.vec3(0.0, 0.0, 1.0))
    right = wp.cross(forward, up)
    depth = wp.max(wp.dot(direction, forward), LEAST_DEPTH)
    x = 0.5 * float(resolution) * (wp.dot(direction, right) / depth + 1.0) - 0.5
    y = 0.5 * float(resolution) * (1.0 - wp.dot(direction, up) / depth) - 0.5
    columns, rows = neighbours_clamped(x, resolution), neighbours_clamped(y, resolution)
    upper = (face * resolution + rows.before) * resolution
    lower = (face * resolution + rows.after) * resolution
    return bilinear_blend(
        columns,
        rows,
        cube[upper + columns.before],
        cube[upper + columns.after],
        cube[lower + columns.before],
        cube[lower + columns.after],
    )


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


class EnvironmentMap(RayMethod):
    """A cube map from each reflector's centre, looked up by direction: the classic baseline."""

    name = "envmap"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``envmap``."""

        resolution: Annotated[int, Field(strict=True, ge=1, le=4096)] = 512
        """Pixels along a side of each face, 1 to 4096."""

    config: Config

    def __init__(self, scene: DeviceScene, config: CommonConfig, tracer: SceneTracer) -> None:
        super().__init__(scene, config, tracer)
        self._cubes: dict[int, wp.array] = {}
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
        """Draw the cube maps on first need, then look up the direction of every ray."""
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
                self._cubes[entry.index] = self._draw_cube(entry, stats)
            with stats.stage("shade", device):
                inputs = [rays, entry.index, self._cubes[entry.index], self.config.resolution, radiance]
                launch.launch(reflect_cube, count, inputs, device)
        return ReflectedLight(summed_by_pixel(gbuffer.reflector_pixels, rays, radiance))

    def _take_memory(self, cubes: int) -> None:
        """Ask for what so many more cube maps need, once for each reflector."""
        if cubes > self._cubes_taken:
            side = self.config.resolution
            what = f"{cubes} cube maps of 6 x {side} x {side} pixels"
            budget.take(PIXEL_BYTES * 6 * side * side * cubes, what, "resolution")
            self._cubes_taken = cubes

    def _draw_cube(self, reflector: DeviceObject, stats: Stats) -> wp.array:
        """(6 * resolution^2,) vec3 radiance about the reflector's centre, face by face, row by row."""
        shadow = shadow_tracer(self.tracer, self.scene, stats)
        eye = reflector.world_from_unit[:3, 3]
        size = max(reflector.longest_side, LEAST_SIZE * float(np.abs(eye).max()))
        side = self.config.resolution
        cube, begin = wp.empty(6 * side * side, dtype=wp.vec3, device=self.scene.device), 0
        with stats.stage("cubemap", self.scene.device):
            for face in range(6):
                forward = np.zeros(3)
                forward[face // 2] = size if face % 2 == 0 else -size
                camera = Camera(
                    eye=tuple(eye.tolist()),
                    look_at=tuple((eye + forward).tolist()),
                    up=(0.0, 1.0, 0.0) if face >= 4 else (0.0, 0.0, 1.0),
                    fov_y=90.0,
                    width=side,
                    height=side,
                )
                for seen in draw_in_bands(self.scene, camera, without=reflector.index):
                    band = cube[begin : begin + seen.pixel_count]
                    shade_gbuffer(seen, shadow, starts_rays=False, radiance=band)
                    begin += seen.pixel_count
        return cube
