"""``Frame``: a rendered image, and what is made of the rest only when it is asked for."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.device.stats import Stats
from ldtrefl.frame.bounce_hits import BounceHits, FirstHits
from ldtrefl.frame.composite import reflection_picture
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.history import Antialiased, FrameParts
from ldtrefl.frame.layers import SMALLER, Layers, LightBand, coverage, joined_cutout, joined_layers
from ldtrefl.frame.see_through import goes_straight_on, places_in
from ldtrefl.scene.description import Camera
from ldtrefl.tracing.ray_buffers import RayBuffer, RayEnds, joined
from ldtrefl.world.camera import Band, CameraView

HIT_BYTES = 112
"""Bytes for each pixel that sees a reflector: its ray and where that ends, joined from all bands."""

LATER_HIT_BYTES = 32
"""Bytes for each ray of a later bounce: where it ends, in its band and joined from all bands."""


class FrameSource(Protocol):
    """What a frame gives beside its image, made when it is asked for."""

    def reflection(self) -> np.ndarray:
        """``Frame.reflection``."""

    def reflector_mask(self) -> np.ndarray:
        """``Frame.reflector_mask``."""

    def sample_counts(self) -> np.ndarray:
        """``Frame.sample_counts``."""

    def hits(self) -> FirstHits | None:
        """``Frame.hits``."""

    def cutout(self, image: np.ndarray) -> np.ndarray:
        """``Frame.cutout`` of this image."""

    def layers(self, image: np.ndarray, *, cutout: bool) -> Layers:
        """``Frame.layers`` of this image."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A rendered image and what it cost. All arrays are the caller's: to write into them changes no other frame.

    All but the image is made when it is first asked for. Of an image of more than 4 million pixels, ``reflection`` and
    ``hits`` are rendered again, because to keep them would take more than the image does. ``layers`` are always
    rendered again, and so are ``alpha`` and ``cutout``, unless all pixels have one sample and nothing lets light
    through.

    Raises:
        InputError: what is asked for of a large image needs more memory than is allowed.
    """

    image: np.ndarray
    """(h, w, 3) float32, linear radiance."""
    stats: Stats
    """``seconds`` per stage and ``counters``."""
    _source: FrameSource

    @functools.cached_property
    def reflection(self) -> np.ndarray:
        """(h, w, 3) float32: the reflected radiance alone, before the reflector's reflectance; 0 outside the mask."""
        return self._source.reflection()

    @functools.cached_property
    def reflector_mask(self) -> np.ndarray:
        """(h, w) bool: pixels that see a reflector."""
        return self._source.reflector_mask()

    @functools.cached_property
    def sample_counts(self) -> np.ndarray:
        """(h, w) uint16: how often each pixel was sampled. ``reflection``, ``reflector_mask`` and ``hits`` are of the
        samples at pixels' centres."""
        return self._source.sample_counts()

    @functools.cached_property
    def hits(self) -> FirstHits | None:
        """Where the first reflected rays ended, and in ``hits.later`` those that went on from there; None for methods
        without rays."""
        return self._source.hits()

    @functools.cached_property
    def alpha(self) -> np.ndarray:
        """(h, w) float32: the share of each pixel that objects cover, 0 to 1."""
        return self.cutout[..., 3].copy()

    @functools.cached_property
    def cutout(self) -> np.ndarray:
        """(h, w, 4) float32: the image without what lies behind all objects, and ``alpha``, multiplied by it."""
        return self._source.cutout(self.image)

    def layers(self, *, cutout: bool = False) -> Layers:
        """What the image is composed of, and what is seen where: a new array for each name in ``frame/layers.py``.

        Args:
            cutout: leave out what lies behind all objects.
        """
        return self._source.layers(self.image, cutout=cutout)


LightAgain = Callable[[bool], Iterator[LightBand]]
"""Renders a frame again, to the same bits, and keeps what it is composed of; True leaves out what lies behind all."""


@dataclass(frozen=True, eq=False)
class WholeFrame:
    """What a frame that was made as a whole gives beside its image.

    Arrays are copied: on the CPU ``numpy`` gives the memory itself, which the next frame may be made of.
    """

    shape: tuple[int, int]
    pixels: wp.array
    """(m,) int32: the pixels that see a reflector."""
    radiance: wp.array
    """(m,) vec3: what is reflected there."""
    reflector: wp.array
    """(h * w,) uint8: 1 for those pixels."""
    object: wp.array
    """(h * w,) int32: what each pixel sees, -1 for nothing."""
    camera: CameraView
    first_hits: FirstHits | None
    antialiased: Antialiased | None
    light_again: LightAgain

    @classmethod
    def of(cls, parts: FrameParts, light_again: LightAgain) -> WholeFrame:
        """Keep what a frame's pictures are made from, and no more: the memory of the other parts is used again."""
        gbuffer, reflected = parts.gbuffer, parts.reflected
        view = gbuffer.view
        seen = (reflected.radiance, view.reflector, view.object, view.camera, reflected.hits)
        return cls(gbuffer.shape, gbuffer.reflector_pixels, *seen, parts.antialiased, light_again)

    def reflection(self) -> np.ndarray:
        """``Frame.reflection``."""
        return reflection_picture(self.shape, self.pixels, self.radiance)

    def reflector_mask(self) -> np.ndarray:
        """``Frame.reflector_mask``."""
        return np.array(self.reflector.numpy()).view(bool).reshape(self.shape)

    def sample_counts(self) -> np.ndarray:
        """``Frame.sample_counts``."""
        return np.ones(self.shape, np.uint16) if self.antialiased is None else self.antialiased.counts.copy()

    def hits(self) -> FirstHits | None:
        """``Frame.hits``: a copy of this frame's own, for hits keep the pictures that they have been asked for."""
        return None if self.first_hits is None else self.first_hits.without_pictures()

    def cutout(self, image: np.ndarray) -> np.ndarray:
        """``Frame.cutout``: made of what is kept, if centres are all that was seen and nothing lets light through."""
        if self.antialiased is not None or self._is_seen_through():
            return joined_cutout(self.shape, self.light_again(True))
        alpha = coverage(self.object.numpy()).reshape(*self.shape, 1)
        return np.concatenate([image * alpha, alpha], axis=2)

    def _is_seen_through(self) -> bool:
        if self.first_hits is None:
            return False
        rays = self.first_hits.rays
        place = places_in(self.shape[1], rays.pixel.numpy())
        return bool(goes_straight_on(self.camera, place, rays).any())

    def layers(self, image: np.ndarray, *, cutout: bool) -> Layers:
        """``Frame.layers``."""
        return joined_layers(image, self.light_again(cutout), cutout=cutout)


@dataclass(frozen=True, eq=False)
class BandedFrame:
    """What a frame that was made in bands gives beside its image. The bands are rendered again, to the same bits."""

    mask: np.ndarray
    counts: np.ndarray
    """(h, w) uint16."""
    render_bands: Callable[[], Iterator[FrameParts]]
    light_again: LightAgain

    def reflection(self) -> np.ndarray:
        """``Frame.reflection``."""
        height, width = self.mask.shape
        budget.take(12 * self.mask.size, f"the reflection in an image of {width} x {height} pixels", SMALLER)
        picture = np.empty((height, width, 3), np.float32)
        for parts in self.render_bands():
            gbuffer = parts.gbuffer
            pixels, radiance = gbuffer.reflector_pixels, parts.reflected.radiance
            picture[rows_of(gbuffer)] = reflection_picture(gbuffer.shape, pixels, radiance)
        return picture

    def reflector_mask(self) -> np.ndarray:
        """``Frame.reflector_mask``."""
        return self.mask

    def sample_counts(self) -> np.ndarray:
        """``Frame.sample_counts``."""
        return self.counts

    def hits(self) -> FirstHits | None:
        """``Frame.hits``."""
        height, width = self.mask.shape
        of_image = f"of an image of {width} x {height} pixels"
        with budget.given_back():
            budget.take(HIT_BYTES * int(np.count_nonzero(self.mask)), f"the reflected rays {of_image}", SMALLER)
            found = []
            for parts in self.render_bands():
                hits = parts.reflected.hits
                if hits is None and parts.gbuffer.reflector_pixels.shape[0]:
                    return None
                if hits is not None:
                    later = sum(bounce.ends.pixel.shape[0] for bounce in hits.later)
                    budget.take(LATER_HIT_BYTES * later, f"the rays of all bounces {of_image}", SMALLER)
                    found.append((parts.gbuffer.band.first_row * width, hits))
            return _joined_hits((height, width), found) if found else None

    def cutout(self, image: np.ndarray) -> np.ndarray:
        """``Frame.cutout``."""
        height, width = self.mask.shape
        return joined_cutout((height, width), self.light_again(True))

    def layers(self, image: np.ndarray, *, cutout: bool) -> Layers:
        """``Frame.layers``."""
        return joined_layers(image, self.light_again(cutout), cutout=cutout)


def _joined_hits(shape: tuple[int, int], bands: list[tuple[int, FirstHits]]) -> FirstHits:
    """The hits of an image from those of its bands, each with the number of its first pixel."""
    units = bands[0][1].device_units_per_world_unit

    def joined_bounce(bounces: list[tuple[int, BounceHits]]) -> BounceHits:
        ends = RayEnds.joined([bounce.ends for _, bounce in bounces])
        pixel = np.concatenate([first + bounce.ends.pixel.numpy() for first, bounce in bounces])
        in_image = wp.array(pixel, dtype=wp.int32, device=ends.t.device)
        return BounceHits(shape, dataclasses.replace(ends, pixel=in_image), units)

    first = joined_bounce([(pixel, hits) for pixel, hits in bands])
    rays = joined(RayBuffer, [hits.rays for _, hits in bands])
    rays.pixel = first.ends.pixel
    most = max(len(hits.later) for _, hits in bands)
    later = [[(pixel, hits.later[k]) for pixel, hits in bands if k < len(hits.later)] for k in range(most)]
    return FirstHits(shape, first.ends, units, rays, tuple(joined_bounce(bounces) for bounces in later))


def inner_rows(band: Band, camera: Camera, beyond: int) -> tuple[slice, slice]:
    """The rows of the image that a band is right for that goes on for so many rows beyond them, if the image does; and
    the same rows in the band. A row that two bands have is right in the one that has its neighbours, too."""
    end = band.first_row + band.rows
    top, bottom = band.first_row + (beyond if band.first_row else 0), end - (beyond if end < camera.height else 0)
    return slice(top, bottom), slice(top - band.first_row, bottom - band.first_row)


def rows_of(gbuffer: GBuffer) -> slice:
    """The rows of the image that a band is."""
    return slice(gbuffer.band.first_row, gbuffer.band.first_row + gbuffer.band.rows)
