"""Mitsuba's paths through the middles of pixels: what they meet, and what they bring.

The loop is written here, over Mitsuba's own intersections, normals, mirrors and emitters, because its ``path``
integrator tells nothing but a picture. Where rays start as Mitsuba's own do (``spawn_ray``), both pictures are the
same; the comparison's table says by how much they differ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ldtrefl.scene.description import Scene

from .mitsuba_scene import mitsuba_scene
from .pixel_rays import PixelRays

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


class MitsubaPictures(PixelRays):
    """Renders an emission-only scene by Mitsuba.

    Raises:
        InputError: Mitsuba cannot be used here.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene, mitsuba_scene(scene))

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
        beyond = dr.select(active, throughput * self._beyond(ray), 0.0)
        pictures = [self._picture(values) for values in (radiance, beyond, mirrors, leaves_below)]
        return MirrorPaths(np.stack(surfaces, axis=-1), *pictures)
