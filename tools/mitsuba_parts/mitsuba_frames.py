"""Whole frames by Mitsuba 3 with a moving camera, which trace the rays that ours trace.

``LitFrames`` does the same work as ours: a loop over Mitsuba's own camera, intersections, mirrors and textures, which
Dr.Jit makes one kernel of, as it does of Mitsuba's integrators. Light is added up as in
``ldtrefl/shading/direct_light.py``: ambient light, and that of directional and point lights, with shadow rays where our
scene has shadows. ``PathFrames`` are by Mitsuba's ``path`` integrator, in which the same rays meet surfaces that glow
in place of lights. In both, rays go through the middles of pixels, mirrors alone send them on, and nothing is diffusely
scattered twice.

The scene is loaded when a class is made. A frame's time includes the camera's move, waiting for the kernel, and numpy's
picture.
"""

from __future__ import annotations

import importlib
import time
from typing import Any, ClassVar

import numpy as np
from benchmark_parts.frame_scenes import moving

from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import Light, Scene
from ldtrefl.world.camera import unit_up

from .emission_only import emission_only
from .mirror_paths import NO_ROULETTE
from .mitsuba_scene import SCALAR_VARIANT, VARIANT, camera_place, mitsuba, mitsuba_scene

EMITTER = "area"
"""Mitsuba's own emitter: it shines from a triangle's front alone, and Dr.Jit knows it without asking Python."""


class MitsubaFrames:
    """Frames of a scene by Mitsuba.

    Raises:
        InputError: Mitsuba cannot be used here, or the scene has what it is not given: emission, Fresnel's law, or a
            picture as environment.
    """

    name: str
    variant = VARIANT
    stages: ClassVar[dict[str, float]] = {}
    """None are known: Mitsuba makes a frame as a whole."""

    def __init__(self, scene: Scene, threads: int) -> None:
        materials = [entry.material for entry in scene.objects]
        if scene.environment.image or scene.environment.preset or any(any(m.emission) or m.fresnel for m in materials):
            raise InputError("Mitsuba's frames have no emission, Fresnel's law or pictures of environments")
        self._threads, self._cameras = threads, moving(scene.camera)
        self._described = scene
        self._mi = self._made_ready()
        self._dr: Any = importlib.import_module("drjit")
        start = time.perf_counter()
        self._scene = mitsuba_scene(emission_only(scene), self.variant, EMITTER)
        self._sensor = self._scene.sensors()[0]
        self._place = self._mi.traverse(self._sensor)
        self._move(scene.camera)
        self.picture = self._render()
        """(h, w, 3) float32: the last frame; at first, the scene by its own camera."""
        self.first = time.perf_counter() - start
        """Seconds of the first frame, with all that is loaded and compiled for it."""

    def frame(self) -> float:
        """Seconds of the next frame, from a camera that has moved to numpy's picture."""
        self._made_ready()
        camera = next(self._cameras)
        start = time.perf_counter()
        self._move(camera)
        self.picture = self._render()
        return time.perf_counter() - start

    def _made_ready(self) -> Any:
        mi = mitsuba(self.variant)
        importlib.import_module("drjit").set_thread_count(self._threads)
        return mi

    def _move(self, camera: Any) -> None:
        """Move the camera that is there: a new one would have Dr.Jit compile again."""
        self._place["to_world"] = camera_place(self._mi, camera)
        self._place.update()

    def _render(self) -> np.ndarray:
        raise NotImplementedError


class PathFrames(MitsubaFrames):
    """Frames by ``path``, many rays at once. Surfaces shine as ``emission_only`` has it."""

    name = "Mitsuba llvm, path"

    def _render(self) -> np.ndarray:
        depth = self._described.reflection.max_bounces + 1
        integrator = self._mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": NO_ROULETTE})
        return np.array(integrator.render(self._scene, self._sensor, spp=1))


class ScalarPathFrames(PathFrames):
    """Frames by ``path``, a ray at a time."""

    name = "Mitsuba scalar, path"
    variant = SCALAR_VARIANT


class LitFrames(MitsubaFrames):
    """Frames with our lights, many rays at once."""

    name = "Mitsuba llvm"

    def _render(self) -> np.ndarray:
        mi, dr, camera = self._mi, self._dr, self._described.camera
        width, height = camera.width, camera.height
        pixel = dr.arange(mi.UInt32, width * height)
        at = mi.Point2f((mi.Float(pixel % width) + 0.5) / width, (mi.Float(pixel // width) + 0.5) / height)
        ray = mi.Ray3f(self._sensor.sample_ray(0.0, 0.5, at, mi.Point2f(0.5))[0])
        state = ray, mi.Bool(True), mi.Color3f(0.0), mi.Color3f(1.0), mi.UInt32(0)
        _, _, radiance, _, _ = dr.while_loop(state, lambda ray, active, *_: active, self._follow)
        return np.array(dr.ravel(radiance)).reshape(height, width, 3)

    def _follow(self, ray: Any, active: Any, radiance: Any, throughput: Any, reflections: Any) -> tuple[Any, ...]:
        """Trace a ray of every pixel, add what it brings, and send it on from mirrors."""
        mi, dr, scene = self._mi, self._dr, self._scene
        met = scene.ray_intersect(ray, mi.RayFlags.All, reflections == 0, active)
        is_hit = active & met.is_valid()
        seen_from_front = mi.SurfaceInteraction3f(met)
        seen_from_front.wi.z = dr.abs(met.wi.z)
        albedo = met.emitter(scene, is_hit).eval(seen_from_front, is_hit)
        brought = dr.select(is_hit, albedo * self._light(ray, met, is_hit), self._environment(ray.d))
        radiance = dr.select(active, radiance + throughput * brought, radiance)
        # Mirrors need no random numbers.
        sample, weight = met.bsdf(ray).sample(mi.BSDFContext(), met, 0.5, mi.Point2f(0.5), is_hit)
        active = is_hit & dr.any(weight > 0.0)
        throughput = dr.select(active, throughput * weight, throughput)
        onwards = met.spawn_ray(met.to_world(sample.wo))
        # As with ours, mirrors beyond the last bounce show the environment.
        is_last = reflections >= self._described.reflection.max_bounces
        beyond = throughput * self._environment(onwards.d)
        radiance = dr.select(active & is_last, radiance + beyond, radiance)
        return onwards, active & ~is_last, radiance, throughput, reflections + 1

    def _light(self, ray: Any, met: Any, is_hit: Any) -> Any:
        """What a white surface scatters: ambient light and that of all lights, on the side that the ray comes from."""
        mi, dr = self._mi, self._dr
        facet = dr.mulsign(met.n, -dr.dot(met.n, ray.d))
        normal = dr.mulsign(met.sh_frame.n, dr.dot(met.sh_frame.n, facet))
        total = mi.Color3f(*self._described.ambient)
        for light in self._described.lights:
            towards, radiance, shadow_ray = self._arriving(light, met)
            cosine = dr.dot(normal, towards)
            is_lit = cosine > 0.0
            if self._described.lighting.shadows:
                is_lit &= ~self._scene.ray_test(shadow_ray, is_hit & is_lit)
            total = dr.select(is_lit, total + cosine * radiance, total)
        return total

    def _arriving(self, light: Light, met: Any) -> tuple[Any, Any, Any]:
        """Of a light: the unit direction to it, the radiance that it gives a white surface, and the ray to it."""
        mi, dr = self._mi, self._dr
        if light.position is not None and light.intensity is not None:
            position = mi.Point3f(*light.position)
            offset = position - met.p
            distance = dr.norm(offset)
            radiance = mi.Color3f(*light.intensity) / dr.square(distance)
            return offset / distance, radiance, met.spawn_ray_to(position)
        assert light.direction is not None and light.radiance is not None
        towards = -dr.normalize(mi.Vector3f(*light.direction))
        return towards, mi.Color3f(*light.radiance), met.spawn_ray(towards)

    def _environment(self, direction: Any) -> Any:
        """The blend from ground to sky, as ours has it."""
        mi, environment = self._mi, self._described.environment
        up = mi.Vector3f(unit_up(self._described.camera).tolist())
        blend = 0.5 + 0.5 * self._dr.dot(direction, up)
        return blend * mi.Color3f(*environment.sky) + (1.0 - blend) * mi.Color3f(*environment.ground)


MITSUBA_FRAMES: tuple[type[MitsubaFrames], ...] = (LitFrames, PathFrames, ScalarPathFrames)
