"""Device space: the world moved and scaled alike along all axes, so that a scene as it was laid out fills the unit box.

It is the same for every scene that comes from one by moves: what is known in it of an object stays true when another
one moves. Positions in it are float64, distances and directions float32: what is near a surface is as precise as the
surface's own object, however large the rest of the scene is, and wherever objects have moved.
"""

from __future__ import annotations

import numpy as np


def device_space(box: np.ndarray) -> np.ndarray:
    """``device_from_world``, (4, 4) float64, from the box that the scene was laid out in, (2, 3) in the world."""
    low, high = box
    half = float((high - low).max()) / 2.0
    scale = 1.0 / half if half > 0.0 else 1.0
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = -(low + (high - low) / 2.0) * scale
    return matrix
