"""Rays of Mitsuba's through the middles of pixels."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from ldtrefl.scene.description import Scene

from .mitsuba_scene import mitsuba

SMALL_LIFT = 1e-6
"""How far above a surface its reflected rays start, over 1 + their largest coordinate, as Mitsuba counts: 16 roundings
of float32. Its own 9e-5 move what mirrors show by up to a texel of a texture near by."""


class PixelRays:
    """Rays in a scene that Mitsuba has loaded, one for each pixel of ours."""

    def __init__(self, scene: Scene, loaded: object) -> None:
        self._size = scene.camera.width, scene.camera.height
        self._scene: Any = loaded
        self._mi: Any = mitsuba()
        self._dr: Any = importlib.import_module("drjit")

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

    def _beyond(self, ray: Any) -> Any:
        """What the environment shows a ray."""
        on_miss = self._dr.zeros(self._mi.SurfaceInteraction3f)
        on_miss.wi = -ray.d
        return self._scene.environment().eval(on_miss)

    def _picture(self, values: Any) -> np.ndarray:
        """(h, w) or (h, w, 3) of an array of all pixels."""
        width, height = self._size
        array = np.array(values)
        return array.T.reshape(height, width, *array.shape[:-1])
