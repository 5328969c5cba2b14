"""How fine an object's maps must be for what is seen of it.

A pixel's reflected ray and its neighbours' are so far apart where they pass the object: that is what a pixel covers
there, its *footprint*. It holds the size of the reflection on the screen, the distance, and the reflector's curvature.
Texels a fixed part of it wide keep the error of reflected points below the pixels asked for.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ldtrefl.cull import Culled
from ldtrefl.device_scene import DeviceObject, DeviceScene
from ldtrefl.rays import bits_of, distance_across, rays_of, run_count

TEXEL = {"exact": 0.25, "linear": 0.75}
"""Texels in footprints for an error of one pixel, by search. Measured on the paper's scenes, sideways to the ray, at
the 99th percentile: patches that stand for rough surfaces are off by up to five texels where a ray grazes a ridge; the
paper's search is off by 0.2 to 1 texel at half a pixel's texels."""

FINEST = 5.0
"""Percentile of an object's footprints that its maps are made for."""

SAMPLES = 4096
"""Rays per object that are looked at."""

SMALLEST, LARGEST = 16, 4096
"""Texels along an object's longest side."""


def footprint(rays: Any, width: int, runs: np.ndarray, entry: DeviceObject) -> float | None:
    """Distance between neighbouring pixels' rays at an object, device units; None if no two neighbours meet its sphere.

    Args:
        rays: a ``RayBuffer``.
        width: pixels in a row of the image.
        runs: (m,) numbers of the runs of rays that may meet the object.
    """
    pixel, source = rays.pixel.numpy(), rays.source.numpy()
    numbers = rays_of(runs, len(pixel))
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
        row[pair] = distance_across(o, d, origin[beside], direction[beside], along)[pair]
    both = np.sqrt(apart[0] * apart[1])
    both = both[np.isfinite(both) & (both > 0.0)]
    return float(np.percentile(both, FINEST)) if len(both) else None


def resolutions_for(
    error: float, search: str, scene: DeviceScene, width: int, rays: Any, culled: Culled
) -> dict[int, int]:
    """Object -> texels along its longest side for an ``error`` in pixels, of the objects that rays can meet.

    Powers of the root of 2, so that maps serve many frames. Objects with one mesh get the finest of theirs.
    """
    bits = culled.regions.bits.numpy()
    by_runs = len(bits) > 0 and culled.regions.rows.shape[0] == 0
    every_run = np.arange(run_count(rays.pixel.shape[0]))
    finest: dict[int, int] = {}
    for index in culled.shown:
        entry = scene.objects[index]
        shows = (bits & bits_of([index], len(scene.objects))).any(axis=1) if by_runs else None
        runs = every_run if shows is None else np.flatnonzero(shows)
        apart = footprint(rays, width, runs, entry)
        wanted = SMALLEST
        if apart is not None:
            longest = entry.longest_side * scene.device_units_per_world_unit
            texels = longest / (TEXEL[search] * error * apart)
            wanted = int(np.clip(round(2.0 ** (np.ceil(2.0 * np.log2(max(texels, 1.0))) / 2.0)), SMALLEST, LARGEST))
        finest[id(entry.geometry)] = max(wanted, finest.get(id(entry.geometry), SMALLEST))
    return {index: finest[id(scene.objects[index].geometry)] for index in culled.shown}
