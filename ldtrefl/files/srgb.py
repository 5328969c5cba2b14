"""The sRGB encoding of linear values (IEC 61966-2-1), and back."""

from __future__ import annotations

import functools

import numpy as np


def srgb_from_linear(linear: np.ndarray) -> np.ndarray:
    """Encode linear values of any shape, clipped to 0..1 first; float32."""
    x = np.clip(linear, 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055).astype(np.float32)


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Decode values in 0..1 of any shape, the inverse of :func:`srgb_from_linear`; float32."""
    x = np.asarray(encoded, np.float32)
    return np.where(x <= 0.04045, x / 12.92, np.power((np.maximum(x, 0.0) + 0.055) / 1.055, 2.4)).astype(np.float32)


@functools.cache
def linear_of_bytes() -> np.ndarray:
    """(256,) float32: the linear value of every byte of an 8-bit picture. It is not to be changed."""
    table = linear_from_srgb(np.arange(256, dtype=np.float32) * np.float32(1.0 / 255.0))
    table.flags.writeable = False
    return table
