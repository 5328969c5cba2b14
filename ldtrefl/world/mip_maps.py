"""Mip maps: a picture again and again, each time half as wide and high, down to a single texel (L. Williams, "Pyramidal
Parametrics", 1983).

A texel is the mean of the part of the larger picture that it covers, in linear light. Of an odd number of texels half
is rounded down: a texel then covers parts of three along that axis, and counts each by its part. Mip maps are stored as
their picture is. Each is made of the one before as that was before it was rounded.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from ldtrefl.files.srgb import linear_of_bytes, srgb_from_linear

ROWS_AT_ONCE = 256
"""Rows of a picture of bytes that are decoded at once; even."""

LINEAR_STEPS = (1 << 16) - 1
"""Steps of linear values that are encoded as bytes by a table. In the dark a byte's step is twenty of them."""

LEAST_ALPHA = 1e-6
"""Below this mean alpha, colours count alike whatever their own alpha."""


def mip_maps(pixels: np.ndarray, alpha: np.ndarray | None = None, *, is_data: bool = False) -> np.ndarray:
    """(n, 3) of the pictures' type: the texels of all mip maps of a picture, row by row, the largest first.

    Args:
        pixels: (h, w, 3) uint8 or float32 picture.
        alpha: (h, w) uint8: colours count by their alpha, so that what is not seen colours nothing. None: alike.
        is_data: bytes are fractions, not sRGB.
    """
    is_bytes = pixels.dtype == np.uint8
    maps = [np.empty((0, 3), np.float32)]
    decode = _fractions() if is_data or not is_bytes else linear_of_bytes()
    if alpha is None:
        for linear in _halved_again_and_again(pixels, decode):
            maps.append(linear.reshape(-1, 3))
    else:
        shares = _halved_again_and_again(alpha[..., None], _fractions())
        colors = _halved_again_and_again(pixels, decode)
        seen = _halved_again_and_again(_times_alpha(pixels, alpha, decode), decode)
        for share, color, part in zip(shares, colors, seen, strict=True):
            weighted = part / np.maximum(share, LEAST_ALPHA)
            maps.append(np.where(share > LEAST_ALPHA, weighted, color).reshape(-1, 3))
    linear = np.concatenate(maps)
    if not is_bytes:
        return linear
    return _rounded(linear) if is_data else _encoded(linear)


def mip_alpha(alpha: np.ndarray) -> np.ndarray:
    """(n,) uint8: the texels of all mip maps of (h, w) uint8 alpha."""
    maps = [level.reshape(-1) for level in _halved_again_and_again(alpha[..., None], _fractions())]
    return _rounded(np.concatenate([np.empty(0, np.float32), *maps]))


def halved(values: np.ndarray, axis: int) -> np.ndarray:
    """Values with half as many along an axis, rounded down, but at least one: means of what each covers."""
    count = values.shape[axis]
    if count == 1:
        return values
    values = np.moveaxis(values, axis, 0)
    half = count // 2
    made: np.ndarray
    if count % 2 == 0:
        made = np.float32(0.5) * (values[0::2] + values[1::2])
    else:
        numbers = np.arange(half).reshape(-1, *[1] * (values.ndim - 1))
        before, after = np.float32((half - numbers) / count), np.float32((numbers + 1) / count)
        made = before * values[0:-1:2] + np.float32(half / count) * values[1::2] + after * values[2::2]
    return np.moveaxis(made, 0, axis)


def _halved_again_and_again(pixels: np.ndarray, decode: np.ndarray) -> Iterator[np.ndarray]:
    """The (h, w, c) float32 linear mip maps of a picture, the largest first."""
    if pixels.shape[0] == 1 and pixels.shape[1] == 1:
        return
    linear = _first_halved(pixels, decode)
    yield linear
    while linear.shape[0] > 1 or linear.shape[1] > 1:
        linear = halved(halved(linear, 1), 0)
        yield linear


def _first_halved(pixels: np.ndarray, decode: np.ndarray) -> np.ndarray:
    """The largest mip map of a picture. A picture of bytes may be large: it is decoded some rows at a time."""
    if pixels.dtype != np.uint8:
        return halved(halved(pixels, 1), 0)
    rows = [halved(decode[pixels[top : top + ROWS_AT_ONCE]], 1) for top in range(0, len(pixels), ROWS_AT_ONCE)]
    return halved(np.concatenate(rows), 0)


def _times_alpha(pixels: np.ndarray, alpha: np.ndarray, decode: np.ndarray) -> np.ndarray:
    """(h, w, 3) float32 linear colours times alpha."""
    linear = decode[pixels] if pixels.dtype == np.uint8 else pixels
    times: np.ndarray = linear * _fractions()[alpha][..., None]
    return times


@functools.cache
def _fractions() -> np.ndarray:
    """(256,) float32: what each byte is of 255."""
    return np.arange(256, dtype=np.float32) / np.float32(255.0)


def _rounded(fractions: np.ndarray) -> np.ndarray:
    """Fractions of any shape as bytes."""
    return (np.clip(fractions, 0.0, 1.0) * np.float32(255.0) + np.float32(0.5)).astype(np.uint8)


@functools.cache
def _byte_of_linear() -> np.ndarray:
    """(LINEAR_STEPS + 1,) uint8: the nearest byte of sRGB to each linear value."""
    return _rounded(srgb_from_linear(np.arange(LINEAR_STEPS + 1, dtype=np.float32) / np.float32(LINEAR_STEPS)))


def _encoded(linear: np.ndarray) -> np.ndarray:
    """Linear values of any shape as bytes of sRGB."""
    return _byte_of_linear()[(np.clip(linear, 0.0, 1.0) * np.float32(LINEAR_STEPS) + np.float32(0.5)).astype(np.int32)]
