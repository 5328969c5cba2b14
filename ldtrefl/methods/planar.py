"""Virtual objects: Zhang, Hsieh and Shen's appendix, and T. McReynolds' course of 1996, for flat mirrors.

Every vertex is mirrored at the mirror's plane; the mirrored triangles are drawn where the mirror is seen, but for what
lies behind its plane. The appendix' matrix takes the plane a x + b y + c z + d = 0 from the cross product of two edges,
whose length must first be divided out; then, with a unit normal n, ``v' = v - 2 (n . v + d) n``, which is that matrix.

    ldtrefl render scene.toml --method planar

A mirror may have several planes, up to 16: a box, a folded screen. Each is drawn by itself.

Fails: on curved mirrors, and flat ones that are shaded as if they were curved, which it refuses by name; a mirror in
the mirror shows the environment alone. Elsewhere it is exact.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.base.errors import NotForThisScene
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Reusable
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.methods.base import CommonConfig, RayMethod
from ldtrefl.methods.virtual.image import VirtualImage
from ldtrefl.methods.virtual.vertex import VirtualVertex
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.tracer import SceneTracer
from ldtrefl.world.camera import CameraView
from ldtrefl.world.device_scene import DeviceScene

MOST_PLANES = 16
"""Planes of a mirror."""

FLAT = 1e-5
"""How far a mirror's vertices may lie off its planes, as a share of its size."""

ALIKE = 1e-3
"""How far shading normals may be from the plane's: the sine of the angle."""


@dataclass(frozen=True, eq=False)
class Planes:
    """The planes of a mirror, in device space."""

    normals: np.ndarray
    """(p, 3) float64 of unit length."""
    offsets: np.ndarray
    """(p,) float64: a point x lies in the plane if ``normal . x + offset`` is 0."""
    of_triangle: np.ndarray
    """(triangles,) the plane of each."""


@launch.kernel
def mirror_vertices(
    first: int,
    # In:
    camera: CameraView,
    normal: wp.vec3d,
    offset: wp.float64,
    points: wp.array(dtype=wp.vec3d),
    # Out:
    vertices_out: wp.array(dtype=VirtualVertex),
):
    """Mirror one point at a plane, on whose side the normal points to the eye."""
    i = first + wp.tid()
    height = wp.dot(normal, points[i]) + offset
    made = VirtualVertex()
    made.position = points[i] - wp.float64(2.0) * height * normal
    # Along a ray from the eye depth grows as the distance does, and is linear on the triangle.
    made.distance = float(wp.dot(made.position - camera.eye, camera.forward))
    made.above = float(height)
    made.is_seen = 1
    vertices_out[i] = made


class Planar(RayMethod):
    """Objects mirrored at flat mirrors' planes and drawn there: exact for flat mirrors, and for no others."""

    name = "planar"

    def __init__(self, scene: DeviceScene, config: CommonConfig, tracer: SceneTracer) -> None:
        super().__init__(scene, config, tracer)
        self._planes: dict[int, Planes] = {}
        """By number of the mirror."""

    def place(self, scene: DeviceScene) -> None:
        """Go on with a scene in which some objects have moved."""
        super().place(scene)
        self._planes.clear()

    def reflect_rays(
        self, gbuffer: GBuffer, rays: RayBuffer, reusable: Reusable | None, stats: Stats
    ) -> ReflectedLight:
        """Draw all objects mirrored at each plane that is seen.

        Raises:
            NotForThisScene: a mirror that is seen is not flat.
        """
        scene, device = self.scene, self.scene.device
        image, triangles = VirtualImage(gbuffer, rays), rays.source_triangle.numpy()
        stats.count("rays", rays.pixel.shape[0])
        with stats.stage("virtual", device):
            for reflector in image.reflectors:
                if reflector not in self._planes:
                    self._planes[reflector] = planes_of(scene, reflector)
                planes = self._planes[reflector]
                is_own = rays.source.numpy() == reflector
                plane_of_ray = np.where(is_own, planes.of_triangle[np.where(is_own, triangles, 0)], -1)
                for number in np.unique(plane_of_ray[is_own]).tolist():
                    mirror = functools.partial(self._mirror, gbuffer, planes.normals[number], planes.offsets[number])
                    image.draw(reflector, mirror, plane_of_ray == number)
        with stats.stage("shade", device):
            return image.reflected(shadow_tracer(self.tracer, scene, stats))

    def _mirror(
        self, gbuffer: GBuffer, normal: np.ndarray, offset: float, points: wp.array, vertices: wp.array
    ) -> None:
        """Mirror points at a plane."""
        camera = gbuffer.view.camera
        side = 1.0 if float(normal @ np.array(camera.eye)) + offset >= 0.0 else -1.0
        inputs = [camera, wp.vec3d(*(side * normal)), wp.float64(side * offset), points, vertices]
        launch.launch(mirror_vertices, points.shape[0], inputs, self.scene.device)


def planes_of(scene: DeviceScene, number: int) -> Planes:
    """The planes in which the triangles of a mirror lie.

    Raises:
        NotForThisScene: they are too many, or its shading normals are not theirs: it is curved.
    """
    entry, mesh = scene.objects[number], scene.meshes[scene.mesh_of[number]]
    matrix = scene.device_from_world @ scene.world_from_unit[number]
    vertices = mesh.mesh.unit_vertices.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    corners = vertices[mesh.mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(across, axis=1)
    of_triangle, left = np.full(len(areas), -1), areas.copy()
    normals: list[np.ndarray] = []
    offsets: list[float] = []
    while (of_triangle < 0).any():
        largest = int(left.argmax())
        if len(normals) == MOST_PLANES:
            raise _curved(entry.source.called, f"it has more than {MOST_PLANES} planes")
        normal = across[largest] / max(areas[largest], np.finfo(float).tiny)
        offset = -float(normal @ corners[largest].mean(axis=0))
        is_in = (of_triangle < 0) & (np.abs(corners @ normal + offset).max(axis=1) <= FLAT * entry.radius)
        is_in[largest] = True
        of_triangle[is_in], left[is_in] = len(normals), -1.0
        normals.append(normal)
        offsets.append(offset)
    planes = Planes(np.array(normals), np.array(offsets), of_triangle)
    if entry.source.smooth is not False:
        linear = np.linalg.inv(matrix[:3, :3])
        shading = mesh.mesh.normals.astype(float)[mesh.mesh.faces] @ linear
        length = np.linalg.norm(shading, axis=2)
        off = np.linalg.norm(np.cross(shading, planes.normals[of_triangle][:, None]), axis=2)
        if (off > ALIKE * length).any():
            raise _curved(entry.source.called, "its shading normals bend; smooth = false takes the facets'")
    return planes


def _curved(name: str, why: str) -> NotForThisScene:
    return NotForThisScene(f"object '{name}': method planar is for flat mirrors, and {why}; ldt or bvh take any mirror")
