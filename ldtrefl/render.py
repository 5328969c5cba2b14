"""G-buffer -> method -> composite."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.device_scene import DeviceScene
from ldtrefl.gbuffer import GBuffer, draw_gbuffer
from ldtrefl.launch import Stats
from ldtrefl.methods import find_method
from ldtrefl.methods.base import Reflection
from ldtrefl.reflect import FirstHits, no_shadows, shade_gbuffer
from ldtrefl.scene import Camera, Scene


@dataclass(frozen=True, eq=False)
class Frame:
    """A rendered image and what it cost."""

    image: np.ndarray
    """(h, w, 3) float32, linear radiance."""
    reflection: np.ndarray
    """(h, w, 3) float32: the reflected radiance alone, before the reflector's reflectance; 0 outside the mask."""
    reflector_mask: np.ndarray
    """(h, w) bool: pixels that see a reflector."""
    stats: Stats
    """``seconds`` per stage and ``counters``."""
    hits: FirstHits | None
    """Where the first reflected rays ended; None for methods without rays."""


@launch.kernel
def add_reflection(
    first: int,
    # In:
    direct: wp.array(dtype=wp.vec3),
    mirror: wp.array(dtype=wp.vec3),
    reflected: wp.array(dtype=wp.vec3),
    # Out:
    image_out: wp.array(dtype=wp.vec3),
):
    i = first + wp.tid()
    image_out[i] = direct[i] + wp.cw_mul(mirror[i], reflected[i])


class Renderer:
    """Renders frames of one scene by one method; keeps G-buffer, maps and trees between frames."""

    def __init__(self, scene: Scene, method: str | None = None, device: str | None = None, **options: Any) -> None:
        """Upload the scene.

        Args:
            scene: what to render.
            method: a name that ``ldtrefl methods`` lists; the scene's own if not given.
            device: 'cpu' (default) or a CUDA device.
            options: the method's, such as ``resolution``.

        Raises:
            InputError: an unknown method, option or device, or a value that is not allowed.
        """
        kind = find_method(scene.reflection.method if method is None else method)
        config = kind.configured(options)
        self.scene = scene
        self._device_scene = DeviceScene(scene, launch.resolve_device(device))
        self._method = kind(self._device_scene, config)
        self._gbuffer: GBuffer | None = None

    def render(self, camera: Camera | None = None) -> Frame:
        """Render a frame, seen by ``camera`` or else by the scene's own."""
        camera = camera or self.scene.camera
        scene, device, stats = self._device_scene, self._device_scene.device, Stats()
        scene.look_from(camera)
        with stats.stage("gbuffer", device):
            if self._gbuffer is None or self._gbuffer.camera != camera or not self._method.skips.frames:
                self._gbuffer = draw_gbuffer(scene, camera)
            gbuffer = self._gbuffer
            mask = gbuffer.reflector_mask
        stats.count("pixels", gbuffer.pixel_count)
        stats.count("reflector_pixels", int(mask.sum()))
        stats.count("rays", 0)
        shadow = self._method.shadow_tracer(stats) if self.scene.lighting.shadows else no_shadows(device)
        with stats.stage("shade", device):
            direct, mirror = shade_gbuffer(gbuffer, shadow)
        if mask.any() or not self._method.skips.reflection:
            reflection = self._method.reflect(gbuffer, stats)
        else:
            reflection = Reflection(wp.zeros(gbuffer.pixel_count, dtype=wp.vec3, device=device))
        with stats.stage("composite", device):
            image = wp.empty(gbuffer.pixel_count, dtype=wp.vec3, device=device)
            launch.launch(add_reflection, gbuffer.pixel_count, [direct, mirror, reflection.radiance, image], device)
            shape = (camera.height, camera.width, 3)
            picture, reflected = (array.numpy().reshape(shape) for array in (image, reflection.radiance))
        return Frame(picture, reflected, mask, stats, reflection.hits)

    def texel_sizes(self, resolution: int) -> np.ndarray:
        """(objects,) length in the world of a texel of each object's maps at ``resolution``."""
        return np.array([entry.longest_side / resolution for entry in self._device_scene.objects])


def render(scene: Scene, method: str | None = None, device: str | None = None, **options: Any) -> Frame:
    """Render one frame; see :class:`Renderer`.

    Raises:
        InputError: an unknown method, option or device, or a value that is not allowed.
    """
    return Renderer(scene, method, device, **options).render()
