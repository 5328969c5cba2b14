"""Cube maps are drawn from a reflector's centre, the reflector left out: one layer, or also what stands behind it.

Other mirrors reflect the environment alone in them, as mirrors do where a ray's bounces are used up.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.camera_shading import shade_gbuffer
from ldtrefl.frame.gbuffer import GBuffer, GBufferView, ray_through
from ldtrefl.frame.visibility import BAND_PIXELS, draw_in_bands
from ldtrefl.geometry.sphere import sphere_entry
from ldtrefl.geometry.vectors import as_single
from ldtrefl.methods.cube_maps.faces import CubeLayer, face_camera
from ldtrefl.methods.cube_maps.peeling import PEELING_BYTES, seen_behind
from ldtrefl.shading.environment import environment_radiance
from ldtrefl.shading.light_shapes import rectangle_entry, seen_light
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.tracing.tracer import BoundTracer
from ldtrefl.world.device_object import DeviceObject
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.records import SPHERE, LightingRecord

RADIANCE_BYTES, NEARNESS_BYTES = 12, 4
"""Bytes of a texel."""

TOUCHING = wp.constant(1.0e-12)
"""Device units from the eye up to which a surface touches it: float64 rounds places in the device's box by a thousandth
of that."""

RAY_BYTES = 80
"""Bytes of the ray of a texel that shows a mirror, and of what that reflects."""

LEAST_SIZE = 1e-6
"""A cube map's camera looks at a point at least this far from the reflector's centre, as a share of the centre's
largest coordinate: a nearer point would be rounded to the centre."""


@launch.kernel
def reflect_environment(
    first: int,
    # In:
    pixels: wp.array(dtype=wp.int32),
    mirror: wp.array(dtype=wp.vec3),
    rays: RayBuffer,
    lighting: LightingRecord,
    # In and out:
    radiance: wp.array(dtype=wp.vec3),
):
    """Let the mirror that one pixel sees reflect the environment."""
    i = first + wp.tid()
    reflected = wp.cw_mul(mirror[i], environment_radiance(lighting, rays.direction[i]))
    radiance[pixels[i]] = radiance[pixels[i]] + reflected


@dataclass(frozen=True)
class Drawn:
    """What is drawn of a cube map."""

    resolution: int
    """Texels along a side of a face."""
    layers: int
    """1, or 2 with what stands behind the first."""
    has_nearness: bool
    """Whether distances are kept, too."""

    @property
    def texels(self) -> int:
        """Texels of a layer."""
        return 6 * self.resolution**2

    @property
    def bytes(self) -> int:
        """Bytes of a cube map."""
        return self.texels * self.layers * (RADIANCE_BYTES + (NEARNESS_BYTES if self.has_nearness else 0))

    @property
    def working_bytes(self) -> int:
        """Bytes beside it while it is drawn."""
        return min(self.resolution**2, BAND_PIXELS) * (RAY_BYTES + (PEELING_BYTES if self.has_nearness else 0))


@launch.kernel
def measure_nearness(
    first: int,
    # In:
    seen: GBufferView,
    position: wp.array(dtype=wp.vec3d),
    lighting: LightingRecord,
    # Out:
    nearness_out: wp.array(dtype=float),
):
    """Measure how near along the camera's axis what one texel shows is: a surface, or a light before it."""
    i = first + wp.tid()
    ray = ray_through(seen, i)
    eye, direction, stretch = seen.camera.eye, as_single(wp.normalize(ray)), float(wp.length(ray))
    distance = float(wp.inf)
    if seen.object[i] >= 0:
        distance = stretch * float(wp.dot(position[i] - eye, seen.camera.forward))
    light = seen_light(lighting, eye, direction, distance)
    if light >= 0:
        if lighting.shaped[light].kind == SPHERE:
            distance = sphere_entry(eye, direction, lighting.shaped[light].position, lighting.shaped[light].radius)
        else:
            distance = rectangle_entry(lighting.shaped[light], eye, direction)
    # What touches the eye has no place: it counts as the environment.
    nearness_out[i] = wp.where(distance > TOUCHING, stretch / distance, 0.0)


def draw_layers(
    drawn: Drawn, scene: DeviceScene, reflector: DeviceObject, shadow: BoundTracer, behind: BoundTracer, by_bounds: bool
) -> list[CubeLayer]:
    """The layers of a cube map about a reflector's centre.

    Args:
        drawn: what is drawn of it.
        scene: where.
        reflector: it is left out.
        shadow: answers shadow rays.
        behind: finds the second layer; it is asked only if there is one.
        by_bounds: an object is searched for it only where a ray enters its sphere.
    """
    layers, begin = [_empty_layer(drawn, scene.device) for _ in range(drawn.layers)], 0
    for gbuffer in _faces(drawn, scene, reflector):
        _store(gbuffer, shadow, layers[0], begin)
        if drawn.layers > 1:
            _store(seen_behind(gbuffer, behind, reflector.index, by_bounds=by_bounds), shadow, layers[1], begin)
        begin += gbuffer.pixel_count
    return layers


def _empty_layer(drawn: Drawn, device: wp.Device) -> CubeLayer:
    layer = CubeLayer()
    layer.radiance = wp.empty(drawn.texels, dtype=wp.vec3, device=device)
    layer.nearness = wp.empty(drawn.texels if drawn.has_nearness else 0, dtype=float, device=device)
    return layer


def _faces(drawn: Drawn, scene: DeviceScene, reflector: DeviceObject) -> Iterator[GBuffer]:
    """What the faces' cameras see, face by face, in bands."""
    eye = reflector.world_from_unit[:3, 3]
    size = max(reflector.longest_side, LEAST_SIZE * float(np.abs(eye).max()))
    for face in range(6):
        camera = face_camera(face, eye, size, drawn.resolution)
        yield from draw_in_bands(scene, camera, without=reflector.index)


def _store(gbuffer: GBuffer, shadow: BoundTracer, layer: CubeLayer, begin: int) -> None:
    """Store what a band sees in a layer, from texel ``begin`` on."""
    end, scene = begin + gbuffer.pixel_count, gbuffer.scene
    radiance, pixels = layer.radiance[begin:end], gbuffer.reflector_pixels
    shaded = shade_gbuffer(gbuffer, shadow, starts_rays=True, radiance=radiance)
    inputs = [pixels, shaded.mirror, shaded.rays, scene.lighting, radiance]
    launch.launch(reflect_environment, pixels.shape[0], inputs, scene.device)
    if layer.nearness.shape[0] > 0:
        inputs = [gbuffer.view, gbuffer.surfaces[0], scene.lighting, layer.nearness[begin:end]]
        launch.launch(measure_nearness, gbuffer.pixel_count, inputs, scene.device)
