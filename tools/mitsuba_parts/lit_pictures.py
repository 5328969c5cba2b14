"""Pictures by Mitsuba of scenes with lights, as ours are: through the middles of pixels, without indirect light.

The loop is over Mitsuba's own intersections, lights and surfaces. At each surface that a path meets, every light adds
what the surface makes of it, shadows aside; then the path goes on along the mirrored ray.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ldtrefl.scene.description import Object, Scene
from ldtrefl.scene.mesh import Part

from .mitsuba_scene import lit_mitsuba_scene
from .pixel_rays import SMALL_LIFT, PixelRays
from .two_plugins import Surface, bsdf_of


class LitPictures(PixelRays):
    """Renders a scene with lights by Mitsuba.

    Args:
        scene: ours.
        surface_of: what Mitsuba is given for each part of an object.
        is_layered: whether surfaces are put together as ours are, rather than Mitsuba's plugins as they are.

    Raises:
        InputError: Mitsuba cannot be used here.
    """

    def __init__(self, scene: Scene, surface_of: Callable[[Object, Part], Surface], *, is_layered: bool) -> None:
        made = lit_mitsuba_scene(scene, lambda entry, part: bsdf_of(surface_of(entry, part), is_layered=is_layered))
        super().__init__(scene, made)

    def render(self, bounces: int) -> tuple[np.ndarray, np.ndarray]:
        """(h, w, 3) float32 radiance, and (h, w) bool: pixels that see an object.

        Args:
            bounces: the most mirrored rays of a path; mirrors beyond them show the environment.
        """
        mi, dr, scene = self._mi, self._dr, self._scene
        ray, active = self._camera_rays(), mi.Bool(True)
        lights = [emitter for emitter in scene.emitters() if not emitter.is_environment()]
        radiance, throughput, sees = mi.Spectrum(0.0), mi.Spectrum(1.0), None
        for _ in range(bounces + 1):
            met = scene.ray_intersect(ray, active)
            is_hit = active & met.is_valid()
            sees = is_hit if sees is None else sees
            radiance += dr.select(active & ~is_hit, throughput * self._beyond(ray), 0.0)
            surface = met.bsdf(ray)
            for light in lights:
                towards, arriving = light.sample_direction(met, mi.Point2f(0.5), is_hit)
                scattered = surface.eval(mi.BSDFContext(), met, met.to_local(towards.d), is_hit)
                radiance += dr.select(is_hit, throughput * scattered * arriving, 0.0)
            # The mirrored ray needs no random numbers.
            sample, weight = surface.sample(mi.BSDFContext(), met, 0.5, mi.Point2f(0.5), is_hit)
            active = is_hit & dr.any(weight > 0.0)
            throughput = dr.select(active, throughput * weight, 0.0)
            ray = self._lifted_ray(met, met.to_world(sample.wo), SMALL_LIFT)
            dr.eval(ray, active, radiance, throughput, sees)
        radiance += dr.select(active, throughput * self._beyond(ray), 0.0)
        return self._picture(radiance), self._picture(sees)
