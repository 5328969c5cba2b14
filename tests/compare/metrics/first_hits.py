"""Hits that are made up."""

from types import SimpleNamespace

import numpy as np
import warp as wp

from ldtrefl.frame.bounce_hits import BounceHits, FirstHits
from ldtrefl.tracing.ray_buffers import RayEnds


def bounce_hits(
    objects: np.ndarray, distance: np.ndarray, followed: np.ndarray | None = None, units: float = 4.0
) -> BounceHits:
    """Hits of one ray a pixel, or of those ``followed``: (h, w) objects and distances in the world, ``units`` device
    units in one of those."""
    height, width = objects.shape
    pixel = np.arange(objects.size) if followed is None else np.flatnonzero(followed)
    ends = RayEnds(
        wp.array(pixel, dtype=wp.int32, device="cpu"),
        wp.array((units * distance).ravel()[pixel].astype(np.float32), dtype=float, device="cpu"),
        wp.array(objects.ravel()[pixel], dtype=wp.int32, device="cpu"),
        wp.zeros(len(pixel), dtype=wp.int32, device="cpu"),
    )
    return BounceHits((height, width), ends, units)


def first_hits(
    objects: np.ndarray, distance: np.ndarray, units: float = 4.0, later: tuple[BounceHits, ...] = ()
) -> FirstHits:
    """First hits of one ray a pixel; see :func:`bounce_hits`."""
    hits = bounce_hits(objects, distance, units=units)
    return FirstHits(hits.shape, hits.ends, units, SimpleNamespace(pixel=hits.ends.pixel), later)
