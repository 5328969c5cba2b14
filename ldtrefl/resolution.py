"""How fine an object's maps must be for what is seen of it.

A pixel's reflected ray and its neighbours' are so far apart where they pass the object: that is what a pixel covers
there, its *footprint*. It holds the size of the reflection on the screen, the distance, and the reflector's curvature.
Texels a fixed part of it wide keep the error of reflected points below the pixels asked for.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ldtrefl.device_scene import DeviceObject

TEXEL = 0.25
"""Texels of a footprint for an error of one pixel. Where patches stand for rough surfaces a hit is off by up to five
texels sideways at the 99th percentile (measured on the test meshes from 32 to 128 texels)."""

FINEST = 5.0
"""Percentile of an object's footprints that its maps are made for."""

SAMPLES = 4096
"""Rays per object that are looked at."""

SMALLEST, LARGEST = 16, 4096
"""Texels along an object's longest side."""


def footprint(rays: Any, width: int, runs: np.ndarray, run_length: int, entry: DeviceObject) -> float | None:
    """Distance between neighbouring pixels' rays at an object, device units; None if no two neighbours meet its sphere.

    Args:
        rays: a ``RayBuffer``.
        width: pixels in a row of the image.
        runs: (m,) numbers of the runs of rays that may meet the object.
        run_length: rays in a run.
    """
    numbers = (runs[:, None] * run_length + np.arange(run_length)).ravel()
    pixel, source = rays.pixel.numpy(), rays.source.numpy()
    numbers = numbers[numbers < len(pixel)]
    numbers = numbers[:: max(1, len(numbers) // SAMPLES)]
    origin, direction = rays.origin.numpy(), rays.direction.numpy()
    o, d = origin[numbers].astype(float), direction[numbers].astype(float)
    offset = np.array(entry.record.centre, float) - o
    along = (offset * d).sum(axis=1)
    meets = (along > 0.0) & ((offset**2).sum(axis=1) - along**2 <= float(entry.record.radius) ** 2)
    apart = np.full((2, len(numbers)), np.nan)
    # In a block of 8 x 8 pixels the next ray is the pixel to the right, the eighth the one below.
    for row, (step, to_pixel) in zip(apart, ((1, 1), (8, width)), strict=True):
        beside = np.minimum(numbers + step, len(pixel) - 1)
        pair = meets & (pixel[beside] == pixel[numbers] + to_pixel) & (source[beside] == source[numbers])
        gap = origin[beside] + along[:, None] * direction[beside] - (o + along[:, None] * d)
        gap -= (gap * d).sum(axis=1, keepdims=True) * d
        row[pair] = np.linalg.norm(gap[pair], axis=1)
    both = np.sqrt(apart[0] * apart[1])
    both = both[np.isfinite(both) & (both > 0.0)]
    return float(np.percentile(both, FINEST)) if len(both) else None


def resolution_for(error: float, footprint_device: float, longest_device: float) -> int:
    """Texels along an object's longest side for an error in pixels: powers of the root of 2, so that maps serve many
    frames."""
    wanted = longest_device / (TEXEL * error * footprint_device)
    return int(np.clip(round(2.0 ** (np.ceil(2.0 * np.log2(max(wanted, 1.0))) / 2.0)), SMALLEST, LARGEST))
