"""How fine an object's maps must be for what is seen of it.

A pixel's reflected ray and its neighbours' are so far apart where they pass the object: that is what a pixel covers
there, its *footprint*. It holds the size of the reflection on the screen, the distance, and the reflector's curvature.
Texels a fixed part of it wide keep the error of reflected points below the pixels asked for. Shadow rays are asked of
the same maps, so with shadows texels are no larger than that part of a pixel on what the camera sees, either.

What is chosen depends on the frame alone: not on frames before, and not on what is skipped.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ldtrefl.cull import Culled
from ldtrefl.device_scene import DeviceMesh, DeviceObject
from ldtrefl.gbuffer import GBuffer
from ldtrefl.ldt import FEWEST_TEXELS, MOST_TEXELS
from ldtrefl.rays import distance_across, rays_of, run_count

TEXEL = {"exact": 0.25, "linear": 0.75}
"""Texels in footprints for an error of one pixel, by search. Measured on the paper's scenes, sideways to the ray, at
the 99th percentile: patches that stand for rough surfaces are off by up to five texels where a ray grazes a ridge; the
paper's search is off by 0.2 to 1 texel at half a pixel's texels."""

FINEST = 5.0
"""Percentile of an object's footprints that its maps are made for."""

CANDIDATES = 65_536
"""Rays of a frame that are tried for whether they meet an object."""

SAMPLES = 4096
"""Rays per object, of those that meet it, that are looked at."""

SURELY = 0.9999
"""Of a bounding sphere's radius what a ray must meet to count: whoever culls by the whole of it has kept that ray."""


def footprint(rays: Any, width: int, runs: np.ndarray, entry: DeviceObject) -> float | None:
    """Distance between neighbouring pixels' rays at an object, device units; None if no two neighbours meet its sphere.

    Args:
        rays: a ``RayBuffer``.
        width: pixels in a row of the image.
        runs: (m,) numbers of the runs of rays that may meet the object.
    """
    pixel, source = rays.pixel.numpy(), rays.source.numpy()
    origin, direction = rays.origin.numpy(), rays.direction.numpy()
    numbers = rays_of(runs, len(pixel))
    # Which rays are looked at must not depend on the runs that others are left out in.
    numbers = numbers[numbers % max(1, len(pixel) // CANDIDATES) == 0]
    numbers = numbers[(source[numbers] >= 0) & (source[numbers] != entry.index)]
    offset = np.array(entry.record.centre, np.float32) - origin[numbers]
    along = (offset * direction[numbers]).sum(axis=1)
    meets = (along > 0.0) & ((offset**2).sum(axis=1) - along**2 <= (SURELY * float(entry.record.radius)) ** 2)
    numbers = numbers[meets]
    numbers = numbers[:: max(1, len(numbers) // SAMPLES)]
    o, d = origin[numbers].astype(float), direction[numbers].astype(float)
    along = ((np.array(entry.record.centre, float) - o) * d).sum(axis=1)
    apart = np.full((2, len(numbers)), np.nan)
    # In a block of 8 x 8 pixels the next ray is the pixel to the right, the eighth the one below.
    for row, (step, to_pixel) in zip(apart, ((1, 1), (8, width)), strict=True):
        beside = np.minimum(numbers + step, len(pixel) - 1)
        pair = (pixel[beside] == pixel[numbers] + to_pixel) & (source[beside] == source[numbers])
        row[pair] = distance_across(o, d, origin[beside], direction[beside], along)[pair]
    both = np.sqrt(apart[0] * apart[1])
    both = both[np.isfinite(both) & (both > 0.0)]
    return float(np.percentile(both, FINEST)) if len(both) else None


def pixel_spacing(gbuffer: GBuffer) -> float | None:
    """Distance between neighbouring pixels on what the camera sees, device units; None if it sees nothing."""
    camera = gbuffer.view.camera
    seen = np.flatnonzero(gbuffer.view.object.numpy() >= 0)
    seen = seen[:: max(1, len(seen) // SAMPLES)]
    if len(seen) == 0:
        return None
    offset = gbuffer.surfaces[0].numpy()[seen].astype(float) - np.array(camera.eye, float)
    depth = float(np.percentile(offset @ np.array(camera.forward, float), FINEST))
    return 2.0 * depth * float(np.linalg.norm(np.array(camera.down, float))) / camera.height


def resolutions_for(
    error: float, search: str, gbuffer: GBuffer, rays: Any, culled: Culled, shadows: bool
) -> dict[DeviceMesh, int]:
    """Mesh -> texels along its longest side for an ``error`` in pixels, of the objects that rays can meet; with
    ``shadows`` of all.

    Powers of the root of 2, so that maps serve many frames. A mesh gets the finest of its objects'.
    """
    scene = gbuffer.scene
    bits = culled.regions.bits.numpy()
    by_runs = len(bits) > 0 and culled.regions.rows.shape[0] == 0
    every_run = np.arange(run_count(rays.pixel.shape[0]))
    spacing = pixel_spacing(gbuffer) if shadows else None
    finest: dict[DeviceMesh, int] = {}
    for entry in scene.objects:
        is_shown = entry.index in culled.shown
        if not is_shown and not shadows:
            continue
        apart = [] if spacing is None else [spacing]
        if is_shown:
            runs = np.flatnonzero(bits[:, entry.index // 32] >> entry.index % 32 & 1) if by_runs else every_run
            reflected = footprint(rays, gbuffer.camera.width, runs, entry)
            apart += [] if reflected is None else [reflected]
        wanted = FEWEST_TEXELS
        if apart and min(apart) > 0.0:
            longest = entry.longest_side * scene.device_units_per_world_unit
            wanted = _rounded_up(longest / (TEXEL[search] * error * min(apart)))
        finest[entry.geometry] = max(wanted, finest.get(entry.geometry, FEWEST_TEXELS))
    return finest


def _rounded_up(texels: float) -> int:
    """The next power of the root of 2, within what is allowed."""
    return int(np.clip(round(2.0 ** (np.ceil(2.0 * np.log2(max(texels, 1.0))) / 2.0)), FEWEST_TEXELS, MOST_TEXELS))
