"""How the environment stands in the world: its frame has ``up`` for z.

Its x is the world's +x, made level; or +y, where ``up`` is near x.
"""

from __future__ import annotations

import numpy as np
import warp as wp

NEAR_X = wp.constant(0.9)
"""Where ``up`` has a larger component along x than this, longitude 0 is at +y rather than +x: an axis near ``up`` tells
no direction across it."""


def world_from_environment(up: np.ndarray, rotation: float) -> np.ndarray:
    """(3, 3) float64: from the frame of an environment that is turned by so many degrees to the world.

    Args:
        up: (3,) float64 unit vector.
        rotation: degrees about ``up``, counter-clockwise seen from above.
    """
    reference = np.array([0.0, 1.0, 0.0]) if abs(up[0]) > float(NEAR_X) else np.array([1.0, 0.0, 0.0])
    ahead = reference - np.vecdot(reference, up) * up
    ahead /= np.sqrt(np.vecdot(ahead, ahead))
    left, angle = np.cross(up, ahead), np.radians(rotation)
    turned = np.cos(angle) * ahead + np.sin(angle) * left
    return np.stack([turned, np.cross(up, turned), up], axis=1)
