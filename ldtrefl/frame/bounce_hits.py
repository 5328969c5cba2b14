"""Where the reflected rays of a frame end, bounce by bounce, as pictures."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.frame.bounces import FollowedRays
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.tracing.ray_buffers import RayBuffer, RayEnds


@dataclass(frozen=True, eq=False)
class BounceHits:
    """Where the rays of one bounce end, per pixel of the image; each picture is made when it is asked for."""

    shape: tuple[int, int]
    """(h, w) of the image."""
    ends: RayEnds
    """Of the rays that were followed this far."""
    device_units_per_world_unit: float

    @functools.cached_property
    def followed(self) -> np.ndarray:
        """(h, w) bool: pixels whose ray was followed this far. The others' ended before, or see no reflector."""
        picture = np.zeros(self.shape[0] * self.shape[1], bool)
        picture[self.ends.pixel.numpy()] = True
        return picture.reshape(self.shape)

    @functools.cached_property
    def distance(self) -> np.ndarray:
        """(h, w) float32 world units along the ray; +inf on a miss and where no ray was followed."""
        return self._picture(self.ends.t, np.inf) / np.float32(self.device_units_per_world_unit)

    @functools.cached_property
    def object(self) -> np.ndarray:
        """(h, w) int32; -1 on a miss and where no ray was followed."""
        return self._picture(self.ends.object, -1)

    @functools.cached_property
    def triangle(self) -> np.ndarray:
        """(h, w) int32; -1 on a miss and where no ray was followed."""
        return self._picture(self.ends.triangle, -1)

    def _picture(self, values: wp.array, fill: float) -> np.ndarray:
        picture = np.full(self.shape[0] * self.shape[1], fill, values.numpy().dtype)
        picture[self.ends.pixel.numpy()] = values.numpy()
        return picture.reshape(self.shape)


@dataclass(frozen=True, eq=False)
class FirstHits(BounceHits):
    """Where the rays of the first reflection end, and those that go on from there."""

    rays: RayBuffer
    """As they started."""
    later: tuple[BounceHits, ...] = ()
    """The second bounce, the third, and so on until no ray goes on."""

    @classmethod
    def of(cls, gbuffer: GBuffer, followed: FollowedRays) -> FirstHits:
        """The hits of rays that were followed from a G-buffer."""
        shape, units = gbuffer.shape, gbuffer.scene.device_units_per_world_unit
        later = tuple(BounceHits(shape, bounce.ends, units) for bounce in followed.later)
        return cls(shape, RayEnds.of(followed.rays, followed.hits), units, followed.rays, later)

    def without_pictures(self) -> FirstHits:
        """The same hits, none of whose pictures has been asked for."""
        return dataclasses.replace(self, later=tuple(dataclasses.replace(bounce) for bounce in self.later))
