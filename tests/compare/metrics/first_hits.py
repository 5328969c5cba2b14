"""First hits that are made up."""

from types import SimpleNamespace

import numpy as np
import warp as wp

from ldtrefl.frame.first_hits import FirstHits


def first_hits(objects: np.ndarray, distance: np.ndarray, units: float = 4.0) -> FirstHits:
    """Hits of one ray a pixel: (h, w) objects and distances in the world, ``units`` device units in one of those."""
    shape = objects.shape
    ends = {
        "t": wp.array((units * distance).ravel().astype(np.float32), dtype=float, device="cpu"),
        "object": wp.array(objects.ravel(), dtype=wp.int32, device="cpu"),
        "triangle": wp.zeros(objects.size, dtype=wp.int32, device="cpu"),
    }
    pixel = wp.array(np.arange(objects.size), dtype=wp.int32, device="cpu")
    return FirstHits((shape[0], shape[1]), SimpleNamespace(pixel=pixel), SimpleNamespace(**ends), units)
