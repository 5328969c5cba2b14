"""How much of an object a pixel covers where its reflected ray passes, by the rays' footprints
(``geometry/footprint.py``), by which textures are filtered, too.

The result depends on this frame alone: neither on earlier frames nor on the option ``skip``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.regions import Regions
from ldtrefl.tracing.object_sets import entries, rays_of, run_count
from ldtrefl.tracing.ray_buffers import RayBuffer
from ldtrefl.world.device_object import DeviceObject

FINEST = 5.0
"""Percentile of an object's footprints that stands for all of them."""

CANDIDATES = 65_536
"""The most rays of a frame that are tested for whether they meet an object."""

SAMPLES = 4096
"""The most rays that are looked at for an object, of those that meet it."""

SURELY = 0.9999
"""A ray counts if it meets a sphere of this share of the bounding sphere's radius: culling, which tests the whole
sphere, has surely kept that ray."""


@dataclass(frozen=True, eq=False)
class RayArrays:
    """Rays of one bounce, as NumPy arrays; see ``RayBuffer``."""

    pixel: np.ndarray
    source: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    may_return: np.ndarray
    footprint: np.ndarray
    """(n,) structured: the fields of ``Footprint``."""

    @classmethod
    def of(cls, rays: RayBuffer) -> RayArrays:
        """The arrays of a buffer whose rays carry their footprints."""
        arrays = (rays.pixel, rays.source, rays.origin, rays.direction, rays.may_return, rays.footprint)
        return cls(*(array.numpy() for array in arrays))


def footprint(rays: RayArrays, spacing: float, runs: np.ndarray, entry: DeviceObject) -> float | None:
    """Distance between neighbouring pixels' rays at an object, device units; None if no ray meets its sphere.

    Args:
        rays: all rays of one bounce.
        spacing: pixels that their footprints reach to.
        runs: (m,) numbers of the runs of rays that may meet the object.
    """
    pixel, source, origin, direction = rays.pixel, rays.source, rays.origin, rays.direction
    numbers = rays_of(runs, len(pixel))
    # The choice of rays must not depend on which runs are left out.
    numbers = numbers[numbers % max(1, len(pixel) // CANDIDATES) == 0]
    may_meet = (source[numbers] != entry.index) | (rays.may_return[numbers] != 0)
    numbers = numbers[(source[numbers] >= 0) & may_meet]
    offset = entry.centre - origin[numbers]
    along = (offset * direction[numbers]).sum(axis=1)
    meets = (along > 0.0) & ((offset**2).sum(axis=1) - along**2 <= (SURELY * entry.radius) ** 2)
    chosen = np.flatnonzero(meets)
    chosen = chosen[:: max(1, len(chosen) // SAMPLES)]
    numbers, along = numbers[chosen], along[chosen]
    both = np.sqrt(_across(rays, numbers, along, "x") * _across(rays, numbers, along, "y")) / spacing
    both = both[np.isfinite(both) & (both > 0.0)]
    return float(np.percentile(both, FINEST)) if len(both) else None


def _across(rays: RayArrays, numbers: np.ndarray, t: np.ndarray, axis: str) -> np.ndarray:
    """(m,) how far the rays of these numbers are at ``t``, (m,), from their neighbours to the right (x) or below (y),
    measured across them."""
    footprints, direction = rays.footprint[numbers], rays.direction[numbers].astype(float)
    gap = footprints[f"place_{axis}"] + t[:, None] * footprints[f"turn_{axis}"]
    gap -= (gap * direction).sum(axis=1, keepdims=True) * direction
    return np.asarray(np.linalg.norm(gap, axis=1))


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


def finest_footprints(gbuffer: GBuffer, rays: RayBuffer, regions: Regions, *, is_seen: bool) -> dict[int, float | None]:
    """Number of an object -> the smallest footprint on it, device units; None where none is known.

    Args:
        rays: the rays of one bounce.
        regions: which objects they can meet; the others are left out.
        is_seen: whether what the camera itself sees counts, too; then no object is left out.
    """
    every_run = np.arange(run_count(rays.pixel.shape[0]))
    are_listed = regions.sets.start.shape[0] > 0
    listed_runs, listed_objects = entries(regions.sets) if are_listed else (every_run, every_run)
    spacing = pixel_spacing(gbuffer) if is_seen else None
    arrays = RayArrays.of(rays)
    finest: dict[int, float | None] = {}
    for entry in gbuffer.scene.objects:
        is_shown = entry.index in regions.shown
        if not is_shown and not is_seen:
            continue
        apart = [spacing]
        if is_shown:
            runs = listed_runs[listed_objects == entry.index] if are_listed else every_run
            apart.append(footprint(arrays, gbuffer.view.camera.spacing, runs, entry))
        finest[entry.index] = min((distance for distance in apart if distance is not None), default=None)
    return finest
