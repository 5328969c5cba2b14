"""Device space: the world moved and scaled alike along all axes so that the objects fill the unit box about 0.

Positions in it are float64, distances and directions float32: what is near a surface is as precise as the surface's own
object, however large the rest of the scene is.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.description import Object

CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
"""(8, 3): of a box's corners, along each axis 0 for its low and 1 for its high side."""


def device_space(corners: np.ndarray) -> np.ndarray:
    """``device_from_world``, (4, 4) float64, from the corners of the objects' boxes, (objects, 8, 3) in the world."""
    if not len(corners):
        return np.eye(4)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    half = float((high - low).max()) / 2.0
    scale = 1.0 / half if half > 0.0 else 1.0
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = -(low + (high - low) / 2.0) * scale
    return matrix


def world_corners(source: Object) -> np.ndarray:
    """(8, 3) float64: the corners of the object's own box, in the world."""
    low, high = source.geometry.bounds
    corners = np.where(CORNERS == 0, low, high)
    return (np.hstack([corners, np.ones((8, 1))]) @ source.world_from_object().T)[:, :3]
