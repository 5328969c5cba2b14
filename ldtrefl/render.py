"""G-buffer -> method -> composite."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.device_scene import DeviceScene
from ldtrefl.gbuffer import GBuffer, draw_gbuffer
from ldtrefl.kept import KeptDrawing
from ldtrefl.launch import Stats
from ldtrefl.methods import find_method
from ldtrefl.methods.base import Reflection
from ldtrefl.reflect import FirstHits, Shaded, no_shadows, shade_gbuffer
from ldtrefl.scene import Camera, Scene, Vector
from ldtrefl.skips import chosen


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
    pixels: wp.array(dtype=wp.int32),
    mirror: wp.array(dtype=wp.vec3),
    reflected: wp.array(dtype=wp.vec3),
    # In and out:
    image: wp.array(dtype=wp.vec3),
):
    i = first + wp.tid()
    pixel = pixels[i]
    image[pixel] = image[pixel] + wp.cw_mul(mirror[i], reflected[pixel])


@dataclass(frozen=True, eq=False)
class _Parts:
    """What a frame is composed of."""

    gbuffer: GBuffer
    shaded: Shaded
    reflection: Reflection
    stages: tuple[str, ...]
    """What was timed."""


class Renderer:
    """Renders frames of one scene by one method; keeps between frames what the next one can use."""

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
        skips = chosen(config.skip)
        self._device_scene = DeviceScene(scene, launch.resolve_device(device), skip_attributes=skips.attributes)
        self._method = kind(self._device_scene, config)
        self._drawing = KeptDrawing()
        self._last: _Parts | None = None

    def move(
        self,
        name: str,
        *,
        translate: Vector | None = None,
        rotate: Sequence[float] | None = None,
        scale: float | Vector | None = None,
    ) -> None:
        """Place the object called ``name`` anew, as in a scene file; what is not given stays.

        Its maps move with it, and the next frame does again only what the move can have changed.

        Raises:
            InputError: an unknown object, or a value that is not allowed.
        """
        given = {"translate": translate, "rotate": rotate, "scale": scale}
        changes = {key: value for key, value in given.items() if value is not None}
        self.scene = self.scene.with_object(name, **changes)
        before, skips = self._device_scene, self._method.skips
        self._device_scene = DeviceScene(self.scene, before.device, before, skip_attributes=skips.attributes)
        self._method.place(self._device_scene)

    def render(self, camera: Camera | None = None) -> Frame:
        """Render a frame, seen by ``camera`` or else by the scene's own."""
        camera = camera or self.scene.camera
        scene, device, stats = self._device_scene, self._device_scene.device, Stats()
        scene.look_from(camera)
        last = self._last if self._method.skips.frames else None
        is_kept = last is not None and last.gbuffer.camera == camera and last.gbuffer.scene is scene
        parts = last if is_kept and last is not None else self._parts(camera, stats)
        self._last = parts
        gbuffer, shaded, reflection = parts.gbuffer, parts.shaded, parts.reflection
        mask = gbuffer.reflector_mask
        reflector_pixels = shaded.rays.pixel.shape[0]
        if is_kept:
            stats.count("frames_kept", 1)
            stats.count("rays_kept", reflector_pixels)
            stats.seconds.update(dict.fromkeys(parts.stages, 0.0))
        stats.count("pixels", gbuffer.pixel_count)
        stats.count("reflector_pixels", reflector_pixels)
        stats.count("rays", 0)
        stats.count("attribute_bytes", scene.attribute_bytes)
        with stats.stage("composite", device):
            image = wp.clone(shaded.radiance)
            inputs = [shaded.rays.pixel, shaded.mirror, reflection.radiance, image]
            launch.launch(add_reflection, reflector_pixels, inputs, device)
            shape = (camera.height, camera.width, 3)
            picture, reflected = (array.numpy().reshape(shape) for array in (image, reflection.radiance))
        return Frame(picture, reflected, mask, stats, reflection.hits)

    def _parts(self, camera: Camera, stats: Stats) -> _Parts:
        """G-buffer, direct light and reflections."""
        scene, device, method = self._device_scene, self._device_scene.device, self._method
        with stats.stage("gbuffer", device):
            gbuffer = self._drawing.gbuffer(scene, camera) if method.skips.frames else draw_gbuffer(scene, camera)
        shadow = method.shadow_tracer(stats) if self.scene.lighting.shadows else no_shadows(device)
        with stats.stage("shade", device):
            shaded = shade_gbuffer(gbuffer, shadow)
        if shaded.rays.pixel.shape[0] or not method.skips.reflection:
            reflection = method.reflect(gbuffer, shaded.rays, stats)
        else:
            reflection = Reflection(wp.zeros(gbuffer.pixel_count, dtype=wp.vec3, device=device))
        return _Parts(gbuffer, shaded, reflection, tuple(stats.seconds))

    @property
    def gbuffer(self) -> GBuffer | None:
        """What the camera saw in the last frame."""
        return None if self._last is None else self._last.gbuffer

    def texel_sizes(self, resolution: int) -> np.ndarray:
        """(objects,) length in the world of a texel of each object's maps at ``resolution``."""
        return np.array([entry.longest_side / resolution for entry in self._device_scene.objects])


def render(scene: Scene, method: str | None = None, device: str | None = None, **options: Any) -> Frame:
    """Render one frame; see :class:`Renderer`.

    Raises:
        InputError: an unknown method, option or device, or a value that is not allowed.
    """
    return Renderer(scene, method, device, **options).render()
