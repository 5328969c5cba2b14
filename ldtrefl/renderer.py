"""G-buffer -> method -> composite.

A large image is made in bands of rows (``camera.py``), so that what is needed beside the image does not grow with it.
Nothing of a large image is kept for the next frame.
"""

from __future__ import annotations

import dataclasses
import functools
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.gbuffer import BAND_PIXELS, GBuffer, draw_gbuffer, draw_in_bands
from ldtrefl.frame.kept import KeptDrawing
from ldtrefl.frame.reflect import FirstHits, Shaded, no_shadows, shade_gbuffer
from ldtrefl.frame.skips import chosen
from ldtrefl.methods import find_method
from ldtrefl.methods.base import Reflection
from ldtrefl.scene.description import Camera, Scene, Vector
from ldtrefl.tracing.rays import HitBuffer, RayBuffer
from ldtrefl.world.device_scene import DeviceScene

LARGEST_WHOLE = 1 << 22
"""Pixels up to which an image is made as a whole: 2048 x 2048."""

IMAGE_BYTES = 13
"""Of a pixel of the result: its radiance, and whether it sees a reflector."""

WORKING_BYTES = 200
"""Of a pixel on the way: its key, what it sees, its radiance, its ray and where that ends."""

HIT_BYTES = 112
"""Of a pixel that sees a reflector: its ray and where that ends, joined from all bands."""

SMALLER = "camera.width or camera.height"
"""What takes less memory."""


class _Source(Protocol):
    """What a frame gives beside its image, made when it is asked for."""

    def reflection(self) -> np.ndarray:
        """``Frame.reflection``."""

    def reflector_mask(self) -> np.ndarray:
        """``Frame.reflector_mask``."""

    def hits(self) -> FirstHits | None:
        """``Frame.hits``."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A rendered image and what it cost. All arrays are the caller's: to write into them changes no other frame.

    All but the image is made when it is first asked for. Of an image of more than 4 million pixels, ``reflection`` and
    ``hits`` are rendered again, because to keep them would take more than the image does.

    Raises:
        InputError: ``reflection`` or ``hits`` of a large image need more memory than is allowed.
    """

    image: np.ndarray
    """(h, w, 3) float32, linear radiance."""
    stats: Stats
    """``seconds`` per stage and ``counters``."""
    _source: _Source

    @functools.cached_property
    def reflection(self) -> np.ndarray:
        """(h, w, 3) float32: the reflected radiance alone, before the reflector's reflectance; 0 outside the mask."""
        return self._source.reflection()

    @functools.cached_property
    def reflector_mask(self) -> np.ndarray:
        """(h, w) bool: pixels that see a reflector."""
        return self._source.reflector_mask()

    @functools.cached_property
    def hits(self) -> FirstHits | None:
        """Where the first reflected rays ended; None for methods without rays."""
        return self._source.hits()


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
    """What a frame, or a band of one, is composed of."""

    gbuffer: GBuffer
    shaded: Shaded
    reflection: Reflection
    stages: tuple[str, ...]
    """What was timed."""


@dataclass(frozen=True, eq=False)
class _Arrays:
    """The rest of a frame that was made as a whole, from the device's arrays: copies, for on the CPU ``numpy`` gives
    the memory that the next frame may be made of."""

    shape: tuple[int, int]
    radiance: wp.array
    reflector: wp.array
    first_hits: FirstHits | None

    def reflection(self) -> np.ndarray:
        return np.array(self.radiance.numpy()).reshape(*self.shape, 3)

    def reflector_mask(self) -> np.ndarray:
        return np.array(self.reflector.numpy()).view(bool).reshape(self.shape)

    def hits(self) -> FirstHits | None:
        # A frame's own, for it keeps the pictures that it has been asked for.
        return None if self.first_hits is None else dataclasses.replace(self.first_hits)


@dataclass(frozen=True, eq=False)
class _Again:
    """The rest of a frame that was made in bands: rendered again by a new renderer, which gives the same bits."""

    mask: np.ndarray
    camera: Camera
    scene: Scene
    method: str
    device: str
    options: dict[str, Any]

    def _bands(self) -> Iterator[_Parts]:
        return Renderer(self.scene, self.method, self.device, **self.options)._bands(self.camera, Stats())

    def reflection(self) -> np.ndarray:
        height, width = self.mask.shape
        budget.take(12 * self.mask.size, f"the reflection in an image of {width} x {height} pixels", SMALLER)
        picture = np.empty((height, width, 3), np.float32)
        for parts in self._bands():
            picture[_rows(parts.gbuffer)] = parts.reflection.radiance.numpy().reshape(*parts.gbuffer.shape, 3)
        return picture

    def reflector_mask(self) -> np.ndarray:
        return self.mask

    def hits(self) -> FirstHits | None:
        height, width = self.mask.shape
        rays = f"the reflected rays of an image of {width} x {height} pixels"
        budget.take(HIT_BYTES * int(np.count_nonzero(self.mask)), rays, SMALLER)
        found = []
        for parts in self._bands():
            if parts.reflection.hits is None and parts.shaded.rays.pixel.shape[0]:
                return None
            if parts.reflection.hits is not None:
                found.append((parts.gbuffer.band.first_row * width, parts.reflection.hits))
        if not found:
            return None
        buffers = _joined(RayBuffer, [hits.rays for _, hits in found]), _joined(HitBuffer, [h.ends for _, h in found])
        pixels = np.concatenate([first + hits.rays.pixel.numpy() for first, hits in found])
        buffers[0].pixel = wp.array(pixels, dtype=wp.int32, device=self.device)
        return FirstHits((height, width), *buffers, found[0][1].device_units_per_world_unit)


def _joined(kind: Any, buffers: Sequence[Any]) -> Any:
    """Arrays of several structs one after another, in one of the same kind."""
    made = kind()
    for name in kind.vars:
        arrays = [getattr(buffer, name) for buffer in buffers]
        values = np.concatenate([array.numpy() for array in arrays])
        setattr(made, name, wp.array(values, dtype=arrays[0].dtype, device=arrays[0].device))
    return made


def _rows(gbuffer: GBuffer) -> slice:
    """The rows of the image that a band is."""
    return slice(gbuffer.band.first_row, gbuffer.band.first_row + gbuffer.band.rows)


class Renderer:
    """Renders frames of one scene by one method; keeps between frames what the next one can use.

    A frame has the bits that a new renderer of the same scene gives, whatever was rendered and moved before. Threads
    may share a renderer: it makes one frame at a time, and a move counts from the next frame that begins; to move and
    to render are two calls, between which another thread's may come. Different renderers work at the same time, on the
    same meshes, too. After a call that fails or is stopped the scene is as it was, and the next frame is right.
    """

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
        if not isinstance(scene, Scene):
            raise InputError(f"a Scene is needed, got {type(scene).__name__} (load_scene reads one from a file)")
        kind = find_method(scene.reflection.method if method is None else method)
        config = kind.configured(options)
        skips = chosen(config.skip)
        self._lock = threading.RLock()
        self._options = dict(options)
        self._device_scene = DeviceScene(scene, launch.resolve_device(device), skip_attributes=skips.attributes)
        self._method = kind(self._device_scene, config)
        self._drawing = KeptDrawing()
        self._last: _Parts | None = None
        self._seen: tuple[DeviceScene, Camera] | None = None
        """By the last frame, if it was made in bands."""
        self._bytes_taken = 0
        """For the largest frame so far."""

    @property
    def scene(self) -> Scene:
        """What is rendered, moves included."""
        return self._device_scene.scene

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
        with self._lock:
            before, skips = self._device_scene, self._method.skips
            scene = before.scene.with_object(name, **changes)
            self._device_scene = DeviceScene(scene, before.device, before, skip_attributes=skips.attributes)

    def render(self, camera: Camera | None = None) -> Frame:
        """Render a frame, seen by ``camera`` or else by the scene's own.

        Raises:
            InputError: ``camera`` is none, or the image needs more memory than is allowed.
        """
        if not isinstance(camera, Camera | None):
            raise InputError(f"a Camera is needed, got {type(camera).__name__}")
        with self._lock:
            camera = camera or self.scene.camera
            self._take_memory(camera)
            if camera.width * camera.height > LARGEST_WHOLE:
                return self._in_bands(camera)
            return self._whole(camera)

    def _take_memory(self, camera: Camera) -> None:
        """Ask for what a frame of this size needs, if none as large has been made."""
        pixels = camera.width * camera.height
        working = pixels if pixels <= LARGEST_WHOLE else BAND_PIXELS
        needed = IMAGE_BYTES * pixels + WORKING_BYTES * working
        if needed > self._bytes_taken:
            budget.take(needed, f"an image of {camera.width} x {camera.height} pixels", SMALLER)
            self._bytes_taken = needed

    def _looking_from(self, camera: Camera) -> DeviceScene:
        """The scene as it stands, ready for a frame."""
        scene = self._device_scene
        scene.look_from(camera)
        if self._method.scene is not scene:
            self._method.place(scene)
        return scene

    def _whole(self, camera: Camera) -> Frame:
        scene, stats = self._looking_from(camera), Stats()
        last = self._last if self._method.skips.frames else None
        is_kept = last is not None and last.gbuffer.camera == camera and last.gbuffer.scene is scene
        if is_kept and last is not None:
            parts = last
            stats.count("frames_kept", 1)
            stats.count("rays_kept", parts.shaded.rays.pixel.shape[0])
            stats.seconds.update(dict.fromkeys(parts.stages, 0.0))
        else:
            self._last = last = None  # its memory is used again
            with stats.stage("gbuffer", scene.device):
                keeps = self._method.skips.frames
                gbuffer = self._drawing.gbuffer(scene, camera) if keeps else draw_gbuffer(scene, camera)
            parts = self._parts(gbuffer, stats)
        image = self._composite(parts, stats)
        self._last, self._seen = parts, None
        stats.count("rays", 0)
        stats.count("attribute_bytes", scene.attribute_bytes)
        shape, view, reflection = parts.gbuffer.shape, parts.gbuffer.view, parts.reflection
        return Frame(image, stats, _Arrays(shape, reflection.radiance, view.reflector, reflection.hits))

    def _in_bands(self, camera: Camera) -> Frame:
        scene, stats = self._device_scene, Stats()
        image = np.empty((camera.height, camera.width, 3), np.float32)
        mask = np.empty((camera.height, camera.width), bool)
        for parts in self._bands(camera, stats):
            image[_rows(parts.gbuffer)] = self._composite(parts, stats)
            mask[_rows(parts.gbuffer)] = parts.gbuffer.reflector_mask
        self._last, self._seen = None, (scene, camera)
        stats.count("rays", 0)
        stats.count("attribute_bytes", scene.attribute_bytes)
        device = str(scene.device)
        return Frame(image, stats, _Again(mask, camera, scene.scene, self._method.name, device, self._options))

    def _bands(self, camera: Camera, stats: Stats) -> Iterator[_Parts]:
        """A large image from top to bottom; nothing of it, nor of the last frame, is kept."""
        scene = self._looking_from(camera)
        self._last = None
        self._drawing.forget()
        self._method.forget()
        bands = draw_in_bands(scene, camera)
        while True:
            with stats.stage("gbuffer", scene.device):
                gbuffer = next(bands, None)
            if gbuffer is None:
                return
            yield self._parts(gbuffer, stats)

    def _parts(self, gbuffer: GBuffer, stats: Stats) -> _Parts:
        """Direct light and reflections."""
        method, scene = self._method, gbuffer.scene
        device = scene.device
        shadow = method.shadow_tracer(gbuffer, stats) if scene.lighting.shadows else no_shadows(device)
        with stats.stage("shade", device):
            shaded = shade_gbuffer(gbuffer, shadow)
        if shaded.rays.pixel.shape[0] or not method.skips.reflection:
            reflection = method.reflect(gbuffer, shaded.rays, stats)
        else:
            reflection = Reflection(wp.zeros(gbuffer.pixel_count, dtype=wp.vec3, device=device))
        return _Parts(gbuffer, shaded, reflection, tuple(stats.seconds))

    def _composite(self, parts: _Parts, stats: Stats) -> np.ndarray:
        """(h, w, 3) float32 radiance of a frame or a band."""
        gbuffer, shaded = parts.gbuffer, parts.shaded
        reflector_pixels = shaded.rays.pixel.shape[0]
        stats.count("pixels", gbuffer.pixel_count)
        stats.count("reflector_pixels", reflector_pixels)
        with stats.stage("composite", gbuffer.scene.device):
            image = wp.clone(shaded.radiance)
            inputs = [shaded.rays.pixel, shaded.mirror, parts.reflection.radiance, image]
            launch.launch(add_reflection, reflector_pixels, inputs, gbuffer.scene.device)
            picture: np.ndarray = image.numpy().reshape(*gbuffer.shape, 3)
        return picture

    @property
    def gbuffer(self) -> GBuffer | None:
        """What the camera saw in the last frame; its pictures are the caller's.

        Raises:
            InputError: a large frame, which keeps none, needs more memory for it than is allowed.
        """
        with self._lock:
            if self._seen is not None:
                scene, camera = self._seen
                pixels = camera.width * camera.height
                budget.take(WORKING_BYTES // 4 * pixels, f"a G-buffer of {camera.width} x {camera.height}", SMALLER)
                return draw_gbuffer(scene, camera)
            return None if self._last is None else dataclasses.replace(self._last.gbuffer)

    def texel_sizes(self, resolution: int) -> np.ndarray:
        """(objects,) length in the world of a texel of each object's maps at ``resolution``."""
        return np.array([entry.longest_side / resolution for entry in self._device_scene.objects])


def render(scene: Scene, method: str | None = None, device: str | None = None, **options: Any) -> Frame:
    """Render one frame; see :class:`Renderer`.

    Raises:
        InputError: an unknown method, option or device, or a value that is not allowed.
    """
    return Renderer(scene, method, device, **options).render()
