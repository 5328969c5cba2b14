"""Mitsuba's paths through the middles of pixels: what they meet, and what they bring.

The loop is written here, over Mitsuba's own intersections, normals, mirrors and emitters, because its ``path``
integrator tells nothing but a picture. Where rays start as Mitsuba's own do (``spawn_ray``), both pictures are the
same; the comparison's table says by how much they differ.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from ldtrefl.scene.description import Scene

from .mitsuba_scene import mitsuba, mitsuba_scene

SMALL_LIFT = 1e-6
"""How far above a surface its reflected rays start, over 1 + their largest coordinate, as Mitsuba counts: 16 roundings
of float32. Its own 9e-5 move what mirrors show by up to a texel of a texture near by."""

NO_ROULETTE = 1000
"""Depth of a path from which on Mitsuba ends some by chance: none is as deep."""


@dataclass(frozen=True, eq=False)
class MirrorPaths:
    """The paths of all pixels of a picture."""

    surfaces: np.ndarray
    """(h, w, bounces + 1) uint32: the number of the surface that each meets with each of its rays; 0 for none."""
    radiance: np.ndarray
    """(h, w, 3) float32 that they bring, the limit of bounces aside."""
    beyond: np.ndarray
    """(h, w, 3) float32: the environment alone where the last bounce sends them, as ours counts mirrors beyond it."""
    mirrors: np.ndarray
    """(h, w) uint32: how many mirrors each meets."""
    leaves_below: np.ndarray
    """(h, w) bool: at a bounce the shading normal sends the path to the other side of the triangle that it came to."""


class MitsubaPictures:
    """Renders an emission-only scene by Mitsuba.

    Raises:
        InputError: Mitsuba cannot be used here.
    """

    def __init__(self, scene: Scene) -> None:
        self._size = scene.camera.width, scene.camera.height
        self._scene = mitsuba_scene(scene)
        self._mi, self._dr = mitsuba(), importlib.import_module("drjit")

    def by_path_integrator(self, bounces: int) -> np.ndarray:
        """(h, w, 3) float32: the picture by Mitsuba's ``path`` integrator."""
        integrator = self._mi.load_dict({"type": "path", "max_depth": bounces + 1, "rr_depth": NO_ROULETTE})
        return np.array(self._mi.render(self._scene, integrator=integrator, spp=1))

    def followed(self, bounces: int, lift: float | None) -> MirrorPaths:
        """Follow every pixel's path.

        Args:
            bounces: the most reflected rays of a path.
            lift: ``SMALL_LIFT``, or None for rays that start where Mitsuba lets them.
        """
        mi, dr, scene = self._mi, self._dr, self._scene
        ray, active = self._camera_rays(), mi.Bool(True)
        radiance, throughput = mi.Spectrum(0.0), mi.Spectrum(1.0)
        leaves_below, mirrors, surfaces = mi.Bool(False), mi.UInt32(0), []
        for _ in range(bounces + 1):
            met = scene.ray_intersect(ray, active)
            radiance += dr.select(active, throughput * met.emitter(scene, active).eval(met, active), 0.0)
            active &= met.is_valid()
            surfaces.append(self._picture(dr.select(active, dr.reinterpret_array(mi.UInt32, met.shape), 0)))
            # Mirrors need no random numbers.
            sample, weight = met.bsdf(ray).sample(mi.BSDFContext(), met, 0.5, mi.Point2f(0.5), active)
            active &= dr.any(weight > 0.0)
            mirrors += dr.select(active, 1, 0)
            throughput = dr.select(active, throughput * weight, 0.0)
            onwards = met.to_world(sample.wo)
            leaves_below |= active & (dr.dot(onwards, met.n) * dr.dot(ray.d, met.n) >= 0.0)
            ray = met.spawn_ray(onwards) if lift is None else self._lifted_ray(met, onwards, lift)
            dr.eval(ray, active, radiance, throughput, leaves_below, mirrors)
        on_miss = dr.zeros(mi.SurfaceInteraction3f)
        on_miss.wi = -ray.d
        beyond = dr.select(active, throughput * scene.environment().eval(on_miss), 0.0)
        pictures = [self._picture(values) for values in (radiance, beyond, mirrors, leaves_below)]
        return MirrorPaths(np.stack(surfaces, axis=-1), *pictures)

    def _camera_rays(self) -> Any:
        mi, (width, height) = self._mi, self._size
        pixel = self._dr.arange(mi.UInt32, width * height)
        x, y = mi.Float(pixel % width) + 0.5, mi.Float(pixel // width) + 0.5
        middle = mi.Point2f(0.5)
        return self._scene.sensors()[0].sample_ray(0.0, 0.5, mi.Point2f(x / width, y / height), middle)[0]

    def _lifted_ray(self, met: Any, direction: Any, lift: float) -> Any:
        """A ray that starts at ``lift``, on the side of the triangle that it goes to."""
        dr = self._dr
        height = dr.mulsign(lift * (1.0 + dr.max(dr.abs(met.p))), dr.dot(met.n, direction))
        return self._mi.Ray3f(met.p + height * met.n, direction)

    def _picture(self, values: Any) -> np.ndarray:
        """(h, w) or (h, w, 3) of an array of all pixels."""
        width, height = self._size
        array = np.array(values)
        return array.T.reshape(height, width, *array.shape[:-1])
