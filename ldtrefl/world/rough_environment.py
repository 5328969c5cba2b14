"""An environment's picture as rough surfaces show it: blurred by the microfacets of each roughness.

A surface is taken to be looked at along its normal (B. Karis, "Real Shading in Unreal Engine 4", 2013): its lobe is
then round about the mirrored direction, and a picture in longitude and latitude is blurred row by row. What a row adds
to another depends on the difference of longitudes alone: it is a convolution, done by Fourier transforms. There is no
noise.
"""

from __future__ import annotations

import functools
import itertools

import numpy as np

from ldtrefl.files.srgb import linear_of_bytes
from ldtrefl.files.stored_picture import StoredPicture

LEVELS = 8
"""Pictures of roughness 1 / LEVELS, 2 / LEVELS, ..., 1."""

ROWS, COLUMNS = 64, 128
"""Pixels of each: 2.8 degrees, which the lobe of the first is as wide as. Of the smoothest the picture itself is shown,
blended with that."""


def rough_environment(picture: StoredPicture) -> np.ndarray:
    """(LEVELS, ROWS, COLUMNS, 3) float32 linear pictures in longitude and latitude, as the given one is."""
    return _blurred(_Keyed(picture))


class _Keyed:
    """A picture that is equal to others with the same pixels."""

    def __init__(self, picture: StoredPicture) -> None:
        self.picture = picture

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Keyed) and other.picture.key == self.picture.key

    def __hash__(self) -> int:
        return hash(self.picture.key)


@functools.lru_cache(maxsize=4)
def _blurred(keyed: _Keyed) -> np.ndarray:
    source = np.fft.rfft(shrunk(keyed.picture.pixels), axis=1)  # (ROWS, f, 3)
    polar = (np.arange(ROWS) + 0.5) / ROWS * np.pi
    turn = np.arange(COLUMNS) / COLUMNS * 2.0 * np.pi
    up, out = np.cos(polar), np.sin(polar)
    # Cosine between a pixel of row i and one of row j, so many columns apart.
    cosine = (up[:, None] * up)[..., None] + (out[:, None] * out)[..., None] * np.cos(turn)
    made = np.empty((LEVELS, ROWS, COLUMNS, 3), np.float32)
    for level in range(LEVELS):
        weights = lobe(cosine, ((level + 1) / LEVELS) ** 2) * out[None, :, None]
        weights /= weights.sum(axis=(1, 2), keepdims=True)
        spectrum = np.fft.rfft(weights, axis=2)
        made[level] = np.fft.irfft(np.einsum("ijf,jfc->ifc", spectrum, source, optimize=True), n=COLUMNS, axis=1)
    np.maximum(made, 0.0, out=made)
    made.flags.writeable = False
    return made


def lobe(cosine: np.ndarray, alpha: float) -> np.ndarray:
    """How much light from directions at these cosines from the mirrored one counts: GGX's density of the microfacets
    half-way, times the cosine with the normal."""
    half_square = 0.5 * (1.0 + np.clip(cosine, -1.0, 1.0))  # squared cosine of half the angle
    density = alpha**2 / ((1.0 - half_square) + alpha**2 * half_square) ** 2
    return np.asarray(density * np.maximum(cosine, 0.0))


def shrunk(pixels: np.ndarray) -> np.ndarray:
    """(ROWS, COLUMNS, 3) float64 linear means of the pixels that lie in each, row by row: a picture may be large."""
    height = len(pixels)
    edges = np.arange(ROWS + 1) / ROWS * height
    made = np.empty((ROWS, COLUMNS, 3))
    for row, (begin, end) in enumerate(itertools.pairwise(edges)):
        first, last = int(begin), min(int(np.ceil(end)), height)
        some = pixels[first:last]
        linear = linear_of_bytes()[some] if some.dtype == np.uint8 else some
        share = np.minimum(np.arange(first, last) + 1.0, end) - np.maximum(np.arange(first, last), begin)
        mean = np.einsum("r,rwc->wc", share / share.sum(), linear, dtype=float)
        total = np.concatenate([np.zeros((1, 3)), np.cumsum(mean, axis=0)])
        places = np.arange(COLUMNS + 1) / COLUMNS * len(mean)
        sums = np.stack([np.interp(places, np.arange(len(total)), total[:, c]) for c in range(3)], axis=1)
        made[row] = np.diff(sums, axis=0) / (len(mean) / COLUMNS)
    return made
