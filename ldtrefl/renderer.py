"""The contents page of a frame: G-buffer -> direct light -> reflection method -> image.

A large image is made in bands of rows (``world/camera.py``), so that what is needed beside the image does not grow with
it. Nothing of a large image is kept for the next frame.
"""

from __future__ import annotations

import dataclasses
import functools
import threading
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.device import build_ahead, launch
from ldtrefl.device.stats import Stats
from ldtrefl.frame.antialiasing import BEYOND, Pictures, antialiased, antialiased_alike, filtered
from ldtrefl.frame.camera_shading import shade_gbuffer
from ldtrefl.frame.composite import composed
from ldtrefl.frame.first_frame import OF_EVERY_SCENE, OF_SAMPLES
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import FrameHistory, FrameParts, Reusable
from ldtrefl.frame.layers import SMALLER, Layers, LightBand, light_of
from ldtrefl.frame.reflected_light import ReflectedLight
from ldtrefl.frame.result import BandedFrame, Frame, LightAgain, WholeFrame, inner_rows
from ldtrefl.frame.sample_points import SamplePoints, camera_rays, regions_of, seen_at
from ldtrefl.frame.skip_options import skip_options_of
from ldtrefl.frame.visibility import BAND_PIXELS, draw_gbuffer, draw_in_bands
from ldtrefl.methods import find_method
from ldtrefl.methods.base import RaylessMethod, RayMethod
from ldtrefl.scene.description import Camera, Object, Scene, Vector
from ldtrefl.tracing.nothing import shadow_tracer
from ldtrefl.tracing.tracer import BoundTracer
from ldtrefl.world.device_scene import DeviceScene, Uploads

__all__ = ["Frame", "Renderer", "render"]

LARGEST_WHOLE = 1 << 22
"""Pixels up to which an image is made as a whole: 2048 x 2048."""

IMAGE_BYTES = 15
"""Bytes of a pixel of the result: its radiance, whether it sees a reflector, and how often it was sampled."""

RAY_COUNTERS = ("rays", "steps", "searches", "searches_saved")
"""What is counted of a frame's rays, those of all samples together."""

WORKING_BYTES = 200
"""Bytes of a pixel on the way: its key, what it sees, its radiance, its ray and where that ends."""

FOOTPRINT_BYTES = 2 * 48
"""Bytes of the footprints of its ray and of that which goes on from there, if rays carry them."""


class Renderer:
    """Renders frames of one scene by one method; keeps between frames what the next one can use.

    A frame has the bits that a new renderer of ``scene`` gives, whatever was rendered and moved before. Another
    scene, laid out with its objects where they have moved to, gives the same picture but for rounding: rays travel
    in a space that is fixed by the box about all objects as they were laid out. Threads may share a renderer: it
    makes one frame at a time, and a move counts from the next frame that begins; to move and to render are two
    calls, between which another thread's may come. Different renderers work at the same time, on the same meshes,
    too. After a call that fails or is stopped the scene is as it was, and the next frame is right.
    """

    def __init__(self, scene: Scene, method: str | None = None, device: str | None = None, **options: object) -> None:
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
        self._lock = threading.RLock()
        self._name, self._options = kind.name, dict(options)
        self._skip = skip_options_of(config.skip)
        self._sampling = config.sampling(scene)
        self._uploads = Uploads(
            self._skip.attributes, config.probes(scene), kind.needs_footprints(config), self._sampling.samples
        )
        device_scene = DeviceScene(scene, launch.resolve_device(device), uploads=self._uploads)
        self._device_scene = device_scene
        """As it stood when it was last needed."""
        self._changed: dict[int, Object] = {}
        """The objects that have changed since, by number: the scene is made anew once for all of them."""
        self._tracer = kind.scene_tracer(config)
        """Answers the rays of methods that have any, and the shadow rays of every method."""
        self._method = kind(device_scene, config, self._tracer)
        if device_scene.device.is_cpu:
            of_samples = OF_SAMPLES if self._sampling.samples > 1 else ()
            build_ahead.foresee([*self._method.first_kernels(), *OF_EVERY_SCENE, *of_samples], launch.thread_count())
        self._history = FrameHistory(keeps=self._skip.frames)
        self._bytes_taken = 0
        """Memory that has been asked for: what the largest frame so far needs."""

    @property
    def scene(self) -> Scene:
        """What is rendered, moves included."""
        return self._as_it_stands().scene

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
            number, entry = self._object_called(name)
            self._changed[number] = entry.changed(**changes)

    def update_vertices(self, name: str, vertices: ArrayLike) -> None:
        """Deform the object called ``name``: its mesh gets these vertices, for the same faces.

        Its normals are made anew from the faces, its maps and trees when they are next needed; ``fit`` places it as
        before. Other objects with the same mesh stay as they are.

        Args:
            name: the object.
            vertices: (n, 3) numbers in the object's own coordinates, as many as it has.

        Raises:
            InputError: an unknown object, more or fewer vertices, or one that is not finite.
        """
        with self._lock:
            number, entry = self._object_called(name)
            self._changed[number] = entry.deformed(vertices)

    def _object_called(self, name: str) -> tuple[int, Object]:
        """The number of the object called ``name``, and the object as it is now."""
        scene = self._device_scene.scene
        number = scene.number_of(name)
        return number, self._changed.get(number, scene.objects[number])

    def _as_it_stands(self) -> DeviceScene:
        """The scene on the device, all changes included."""
        with self._lock:
            if self._changed:
                before = self._device_scene
                scene = before.scene.with_objects(self._changed)
                self._device_scene = DeviceScene(scene, before.device, before, uploads=self._uploads)
                self._changed = {}
            return self._device_scene

    def render(self, camera: Camera | None = None) -> Frame:
        """Render a frame, seen by ``camera`` or else by the scene's own.

        Raises:
            InputError: ``camera`` is no Camera, or the image needs more memory than is allowed.
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
        of_ray = FOOTPRINT_BYTES if self._as_it_stands().features.footprints else 0
        needed = IMAGE_BYTES * pixels + (WORKING_BYTES + of_ray) * working
        if needed > self._bytes_taken:
            budget.take(needed, f"an image of {camera.width} x {camera.height} pixels", SMALLER)
            self._bytes_taken = needed

    def _looking_from(self, camera: Camera) -> DeviceScene:
        """The scene as it stands, ready for a frame."""
        scene = self._as_it_stands()
        scene.look_from(camera)
        if self._method.scene is not scene:
            self._method.place(scene)
        return scene

    def _whole(self, camera: Camera) -> Frame:
        scene, stats = self._looking_from(camera), Stats()
        parts = self._history.unchanged(scene, camera)
        if parts is not None:
            stats.count("frames_kept", 1)
            stats.count("rays_kept", parts.shaded.rays.pixel.shape[0])
            stats.seconds.update(dict.fromkeys(parts.stages, 0.0))
        else:
            reusable = self._history.reusable(scene, camera)
            search = self._method.camera_search(scene, camera, stats)
            with stats.stage("gbuffer", scene.device):
                gbuffer = self._history.gbuffer(scene, camera, search)
            parts = self._parts(gbuffer, reusable, stats)
        parts, image = self._with_samples(parts, stats)
        self._history.keep(scene, camera, parts)
        self._count(scene, parts.gbuffer.reflector_mask, stats)
        return Frame(image, stats, WholeFrame.of(parts, self._light_again(scene, camera)))

    def _in_bands(self, camera: Camera) -> Frame:
        scene, stats = self._as_it_stands(), Stats()
        image = np.empty((camera.height, camera.width, 3), np.float32)
        mask, counts = (np.empty((camera.height, camera.width), kind) for kind in (bool, np.uint16))
        for parts in self._bands(camera, stats, self._beyond):
            sampled, band = self._with_samples(parts, stats)
            inner, within = inner_rows(parts.gbuffer.band, camera, self._beyond)
            image[inner] = band[within]
            mask[inner] = parts.gbuffer.reflector_mask[within]
            counts[inner] = 1 if sampled.antialiased is None else sampled.antialiased.counts[within]
        self._history.keep_view(scene, camera)
        self._count(scene, mask, stats)
        again = self._bands_again(scene, camera), self._light_again(scene, camera)
        return Frame(image, stats, BandedFrame(mask, counts, *again))

    @property
    def _beyond(self) -> int:
        """Rows beyond a band that its own depend on."""
        return 0 if self._sampling.samples == 1 else BEYOND

    def _bands_again(self, scene: DeviceScene, camera: Camera) -> Callable[[], Iterator[FrameParts]]:
        """A function that renders the bands again by a new renderer, whatever moves meanwhile."""
        description, device = scene.scene, str(scene.device)

        def bands() -> Iterator[FrameParts]:
            return Renderer(description, self._name, device, **self._options)._bands(camera, Stats())

        return bands

    def _light_again(self, scene: DeviceScene, camera: Camera) -> LightAgain:
        """A function that renders what a frame is composed of by a new renderer, whatever moves meanwhile."""
        # The function goes with the frame: it must not hold on to this renderer and its maps.
        description, name, device, options = scene.scene, self._name, str(scene.device), self._options

        def bands(cutout: bool) -> Iterator[LightBand]:
            return Renderer(description, name, device, **options)._light(camera, cutout)

        return bands

    def _light(self, camera: Camera, cutout: bool) -> Iterator[LightBand]:
        """What an image is composed of, band by band. From now on the method keeps all bounces."""
        method, most = self._method, 1
        if isinstance(method, RayMethod):
            method.keeps_bounces, most = True, method.most_bounces
        for parts in self._bands(camera, Stats(), self._beyond):
            light = light_of(parts, most, cutout=cutout)
            if self._sampling.samples > 1:
                pictures_at = functools.partial(self._light_at, parts.gbuffer, most, cutout)
                centres = _on_device(light, parts.gbuffer)
                found = antialiased_alike(parts, centres, self._sampling, pictures_at)
                light = {name: filtered(found[name], centres[name], self._sampling).numpy() for name in found}
            yield LightBand(parts, *inner_rows(parts.gbuffer.band, camera, self._beyond), light)

    def _light_at(self, image: GBuffer, most: int, cutout: bool, place: wp.array) -> Pictures:
        """What is seen at (n,) vec2d points of a band's image, in its pixels."""
        return _on_device(light_of(self._parts_at(image, Stats(), place), most, cutout=cutout), image)

    def _bands(self, camera: Camera, stats: Stats, beyond: int = 0) -> Iterator[FrameParts]:
        """A large image from top to bottom; nothing of it, nor of the last frame, is kept. Each band goes on for
        ``beyond`` rows."""
        scene = self._looking_from(camera)
        self._history.forget()
        search = self._method.camera_search(scene, camera, stats)
        bands = draw_in_bands(scene, camera, search, beyond=beyond)
        while True:
            with stats.stage("gbuffer", scene.device):
                gbuffer = next(bands, None)
            if gbuffer is None:
                return
            yield self._parts(gbuffer, None, stats)

    def _parts(self, gbuffer: GBuffer, reusable: Reusable | None, stats: Stats) -> FrameParts:
        """Shade what the camera sees, and let the method find the reflections in it."""
        method, device = self._method, gbuffer.scene.device
        shadow = self._shadow_tracer(gbuffer, stats)
        with stats.stage("shade", device):
            starts_rays, spare = isinstance(method, RayMethod), self._history.take_spare_radiance()
            shaded = shade_gbuffer(gbuffer, shadow, starts_rays=starts_rays, radiance=spare)
        if not gbuffer.reflector_pixels.shape[0] and self._skip.reflection:
            reflected = ReflectedLight(wp.empty(0, dtype=wp.vec3, device=device))
        elif isinstance(method, RayMethod):
            reflected = method.reflect_rays(gbuffer, shaded.rays, reusable, stats)
        else:
            assert isinstance(method, RaylessMethod)
            reflected = ReflectedLight(method.reflect(gbuffer, stats))
        return FrameParts(gbuffer, shaded, reflected, tuple(stats.seconds))

    def _shadow_tracer(self, gbuffer: GBuffer, stats: Stats) -> BoundTracer:
        """The tracer that answers the shadow rays of what the camera sees."""
        if gbuffer.scene.scene.lighting.is_traced and not isinstance(gbuffer, SamplePoints):
            self._method.foresee(gbuffer, stats)
        return shadow_tracer(self._tracer, gbuffer.scene, stats)

    def _with_samples(self, parts: FrameParts, stats: Stats) -> tuple[FrameParts, np.ndarray]:
        """A frame or a band with more samples where it needs them, and (h, w, 3) float32 its radiance."""
        gbuffer, known = parts.gbuffer, parts.antialiased
        with stats.stage("composite", gbuffer.scene.device):
            radiance = composed(parts)
        if self._sampling.samples > 1:
            with stats.stage("samples", gbuffer.scene.device):
                if known is None:
                    seen = functools.partial(self._seen, gbuffer, stats)
                    known = antialiased(parts, radiance, self._sampling, seen)
                radiance = filtered(known, radiance, self._sampling)
            stats.count("samples", int(known.counts.sum()))
        return dataclasses.replace(parts, antialiased=known), radiance.numpy().reshape(*gbuffer.shape, 3)

    def _seen(self, image: GBuffer, stats: Stats, place: wp.array) -> wp.array:
        """(n,) vec3: the radiance that (n,) vec2d points of a band's image see, in its pixels."""
        of_samples = Stats()
        parts = self._parts_at(image, of_samples, place)
        for name in RAY_COUNTERS:
            stats.count(name, of_samples.counters.get(name, 0))
        return composed(parts)

    def _parts_at(self, image: GBuffer, stats: Stats, place: wp.array) -> FrameParts:
        """What these points see, and what is reflected there."""
        rays = camera_rays(image, place)
        regions = regions_of(image, rays)
        tracer = self._method.sample_tracer(image.scene, regions.shown, stats)
        points = seen_at(image, place, rays, regions, tracer, by_bounds=self._skip.bounds)
        return self._parts(points, None, stats)

    def _count(self, scene: DeviceScene, mask: np.ndarray, stats: Stats) -> None:
        stats.count("pixels", mask.size)
        stats.count("reflector_pixels", int(np.count_nonzero(mask)))
        stats.count("rays", 0)  # methods without rays have that counter, too
        stats.count("attribute_bytes", scene.attribute_bytes)

    @property
    def gbuffer(self) -> GBuffer | None:
        """What the camera saw in the last frame; its pictures are the caller's.

        Raises:
            InputError: a large frame, which keeps none, needs more memory for it than is allowed.
        """
        with self._lock:
            kept, view = self._history.last_gbuffer, self._history.last_view
            if kept is not None:
                return dataclasses.replace(kept)
            if view is None:
                return None
            scene, camera = view
            pixels = camera.width * camera.height
            budget.take(WORKING_BYTES // 4 * pixels, f"a G-buffer of {camera.width} x {camera.height}", SMALLER)
            return draw_gbuffer(scene, camera, self._method.camera_search(scene, camera, Stats()))

    def texel_sizes(self, resolution: int) -> np.ndarray:
        """(objects,) length in the world of a texel of each object's maps at ``resolution``."""
        return np.array([entry.longest_side / resolution for entry in self._as_it_stands().objects])


def _on_device(pictures: Layers, gbuffer: GBuffer) -> Pictures:
    """(n,) vec3 of each picture."""
    return {name: wp.array(values, dtype=wp.vec3, device=gbuffer.scene.device) for name, values in pictures.items()}


def render(scene: Scene, method: str | None = None, device: str | None = None, **options: object) -> Frame:
    """Render one frame; see :class:`Renderer`.

    Raises:
        InputError: an unknown method, option or device, or a value that is not allowed.
    """
    return Renderer(scene, method, device, **options).render()
