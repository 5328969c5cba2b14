"""How fine an object's maps must be for what is seen of it.

A pixel's *footprint* is how far apart the points are that it and its neighbour see (``frame/footprint.py``). Texels
that are a fixed part of it wide keep the error of reflected points below the pixels that are asked for. Shadow rays are
searched for in the same maps. So with shadows texels are no larger than that part of the footprint on what the camera
sees, either.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.ldt.options import FEWEST_TEXELS, MOST_TEXELS
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_scene import DeviceScene

TEXEL = {"exact": 0.25, "linear": 0.75}
"""Side of a texel, in footprints, for an error of one pixel, by search.

Measured on the paper's scenes, sideways to the ray, at the 99th percentile: patches that stand for rough surfaces are
off by up to five texels where a ray grazes a ridge; the paper's search is off by 0.2 to 1 texel at half a pixel's
texels."""


def resolutions_for(
    error: float, search: str, scene: DeviceScene, footprints: dict[int, float | None]
) -> dict[DeviceMesh, int]:
    """Mesh -> texels along its longest side for an ``error`` in pixels.

    Resolutions are powers of the root of 2, so that maps serve many frames. A mesh gets the finest that any of its
    objects needs.

    Args:
        error: how many pixels reflected points may be off by.
        search: name of the search.
        scene: whose objects the footprints are on.
        footprints: number of an object -> the smallest footprint on it, device units; None where none is known.
    """
    finest: dict[DeviceMesh, int] = {}
    for number, footprint in footprints.items():
        entry, wanted = scene.objects[number], FEWEST_TEXELS
        if footprint is not None and footprint > 0.0:
            longest = entry.longest_side * scene.device_units_per_world_unit
            wanted = _rounded_up(longest / (TEXEL[search] * error * footprint))
        finest[entry.geometry] = max(wanted, finest.get(entry.geometry, FEWEST_TEXELS))
    return finest


def _rounded_up(texels: float) -> int:
    """The next power of the root of 2, within what is allowed."""
    return int(np.clip(round(2.0 ** (np.ceil(2.0 * np.log2(max(texels, 1.0))) / 2.0)), FEWEST_TEXELS, MOST_TEXELS))
