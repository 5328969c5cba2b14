"""Where the first reflected rays of a frame end, as pictures."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.frame.bounces import FollowedRays
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.tracing.ray_buffers import HitBuffer, RayBuffer


@dataclass(frozen=True, eq=False)
class FirstHits:
    """Where the rays of the first reflection end, per pixel of the image; each picture is made when it is asked for."""

    shape: tuple[int, int]
    """(h, w) of the image."""
    rays: RayBuffer
    """As they started; each tells its pixel."""
    ends: HitBuffer
    """Where each ends."""
    device_units_per_world_unit: float

    @classmethod
    def of(cls, gbuffer: GBuffer, followed: FollowedRays) -> FirstHits:
        """The first hits of rays that were followed from a G-buffer."""
        return cls(gbuffer.shape, followed.rays, followed.hits, gbuffer.scene.device_units_per_world_unit)

    @functools.cached_property
    def distance(self) -> np.ndarray:
        """(h, w) float32 world units along the ray; +inf on a miss and outside the reflectors."""
        return self._picture(self.ends.t, np.inf) / np.float32(self.device_units_per_world_unit)

    @functools.cached_property
    def object(self) -> np.ndarray:
        """(h, w) int32; -1 on a miss and outside the reflectors."""
        return self._picture(self.ends.object, -1)

    @functools.cached_property
    def triangle(self) -> np.ndarray:
        """(h, w) int32; -1 on a miss and outside the reflectors."""
        return self._picture(self.ends.triangle, -1)

    def _picture(self, values: wp.array, fill: float) -> np.ndarray:
        picture = np.full(self.shape[0] * self.shape[1], fill, values.numpy().dtype)
        picture[self.rays.pixel.numpy()] = values.numpy()
        return picture.reshape(self.shape)
