"""Fermat's principle, vertex by vertex: D. Roger, N. Holzschuch, "Réflexions spéculaires en temps réel sur des surfaces
lisses" (in French, before their paper of 2006). Sections and equations below are that paper's.

Light takes the way of extremal length (section 3.3): a vertex V is seen from E at the point P of the mirror where
``d = EP + PV`` is. P is searched for in the parameters (u, v) of the mirror, by f, df/du and df/dv in textures
(section 3.1): longitude, and the angle from a pole, about a point that sees all of the mirror. The pole points up, as
the scene's camera does. Three points are kept, the first two where the lines from that point to V and to E meet the
mirror (3.3.1). The gradient of d at each (3.3.2),

    dd/du = -df/du . ((E - f) / |E - f| + (V - f) / |V - f|), dd/dv likewise,

is interpolated between them; where it is 0 (3.2, by Cramer's rule; 3.1) is the new point, and the one furthest from it
is dropped. Four or five such steps suffice (3.3.3). The third point is left open by the paper but for not lying on the
line between the others: here it is a guess of P.

    ldtrefl render scene.toml --method fermat-uv --set steps=8

``steps`` is how many new points a search may take, 5 if not given; it ends sooner where the triangle is small, or so
flat that there is only rounding left (3.3.3). ``resolution`` is the number of rows of the textures from pole to pole.

What is hidden is found twice (3.4). Of what is reflected at one point the nearest to it is seen: the depth is PV. And a
point of the mirror that lies behind the mirror itself is not seen: the paper compares it with the mirror's own depth.
Between vertices points are interpolated, and lie behind the front of a convex mirror, which that test would leave
empty. So they are compared with the frontmost back faces, as in the paper of 2006 (its section 3.3.6). That P is on the
side where E and V are is asked at each vertex: for a V behind the mirror the way is shortest where the line EV pierces
it. Where the law of reflection is missed by far, the search has failed, and the vertex' triangles are left out.

Fails, as the paper says, on

- long triangles: their edges stay straight, where a curved mirror bends them (sections 2.2 and 4). It needs scenes of
  small triangles;
- vertices that are seen several times, as in concave mirrors: one of their reflections is drawn at most (2.2);
- reflections near a pole, where df/du is 0: they are bent or have holes (4);
- mirrors with edges and corners, where interpolated gradients lead astray (5).

Also, of an open mirror those triangles are left out that reach beyond its rim; a mirror in the mirror shows the
environment alone. A mirror that is not star-shaped is refused by name.
"""

from __future__ import annotations

import functools
from typing import Annotated

import numpy as np
import warp as wp
from pydantic import Field
from pydantic.dataclasses import dataclass

from ldtrefl.base import budget
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.methods.base import CONFIG, CommonConfig, RayMethod
from ldtrefl.methods.virtual.image import VirtualImage
from ldtrefl.methods.virtual.star_shape import star_shape_of
from ldtrefl.methods.virtual.uv_search import find_uv_reflection
from ldtrefl.methods.virtual.uv_surface import KEPT_BYTES, UvSurface, sample_count, uv_surface
from ldtrefl.methods.virtual.vertex import VirtualVertex, not_seen, unfolded
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.tracer import SceneTracer
from ldtrefl.world.camera import CameraView
from ldtrefl.world.device_scene import DeviceScene


@launch.kernel
def place_uv_vertices(
    first: int,
    # In:
    camera: CameraView,
    surface: UvSurface,
    steps: int,
    points: wp.array(dtype=wp.vec3d),
    # Out:
    vertices_out: wp.array(dtype=VirtualVertex),
    steps_out: wp.array(dtype=wp.int32),  # that were taken
):
    """Find where one point is seen."""
    i = first + wp.tid()
    found = find_uv_reflection(surface, camera.eye, points[i], steps)
    made = not_seen()
    if found.is_seen == 1:
        depth = wp.dot(found.point - camera.eye, camera.forward)
        made = unfolded(camera.eye, found.point, points[i], depth)
    vertices_out[i] = made
    steps_out[i] = found.steps


class FermatUv(RayMethod):
    """Vertices drawn where smooth convex mirrors show them, searched for in (u, v): for fine meshes, not at poles."""

    name = "fermat-uv"

    @dataclass(frozen=True, kw_only=True, config=CONFIG)
    class Config(CommonConfig):
        """Options of ``fermat-uv``."""

        steps: Annotated[int, Field(strict=True, ge=1, le=100)] = 5
        """New points of a search at most, 1 to 100."""
        resolution: Annotated[int, Field(strict=True, ge=8, le=1024)] = 256
        """Rows of a mirror's textures from pole to pole, 8 to 1024; they have twice as many columns."""

    config: Config

    def __init__(self, scene: DeviceScene, config: CommonConfig, tracer: SceneTracer) -> None:
        super().__init__(scene, config, tracer)
        self._surfaces: dict[int, UvSurface] = {}
        """By number of the mirror."""
        self._surfaces_taken = 0
        """The number of surfaces that memory has been asked for."""

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved."""
        super().place(scene)
        self._surfaces.clear()

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Draw all objects where each mirror that is seen shows their vertices.

        Raises:
            InputError: a mirror that is seen is not star-shaped, or its textures need more memory than is allowed.
        """
        scene, device = self.scene, self.scene.device
        image = VirtualImage(gbuffer, rays)
        stats.count("rays", rays.pixel.shape[0])
        for reflector in image.reflectors:
            if reflector not in self._surfaces:
                with stats.stage("textures", device):
                    self._surfaces[reflector] = self._sampled(reflector)
                    self._take_memory()
            with stats.stage("virtual", device):
                image.draw(reflector, functools.partial(self._place, gbuffer, self._surfaces[reflector], stats))
        with stats.stage("shade", device):
            return image.reflected(shadow_tracer(self.tracer, scene, stats))

    def _sampled(self, reflector: int) -> UvSurface:
        """The textures of a mirror."""
        scene = self.scene
        shape = star_shape_of(scene.objects[reflector], scene.device_from_world)
        up = scene.device_from_world[:3, :3] @ np.array(scene.scene.camera.up)
        return uv_surface(shape, up, self.config.resolution, scene.device)

    def _take_memory(self) -> None:
        """Ask for what the textures that are kept need, once for each mirror."""
        if len(self._surfaces) > self._surfaces_taken:
            samples = sample_count(self.config.resolution)
            budget.take(KEPT_BYTES * samples, f"textures of a mirror, {samples} samples", "resolution")
            self._surfaces_taken = len(self._surfaces)

    def _place(self, gbuffer: GBuffer, surface: UvSurface, stats: Stats, points: wp.array, vertices: wp.array) -> None:
        """Find where a mirror shows points."""
        count, device = points.shape[0], self.scene.device
        steps = wp.zeros(count, dtype=wp.int32, device=device)
        inputs = [gbuffer.view.camera, surface, self.config.steps, points, vertices, steps]
        launch.launch(place_uv_vertices, count, inputs, device)
        stats.count("vertices", count)
        stats.count("steps", int(steps.numpy().sum(dtype=np.int64)))
