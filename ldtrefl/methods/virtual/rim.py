"""An open star-shaped surface, continued beyond its rim.

What is mirrored next to the rim has neighbours whose reflections would be beyond it: the triangles between are drawn as
far as the reflector is seen, so these must be known. The radius goes on as it bends: the first and second derivatives
of its logarithm, along the great circle that comes to the rim.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

RIM = 0.25
"""Radians, as seen from O, by which a surface is continued."""

INSIDE = 0.05
"""Radians from the rim to where slopes are compared with those at the rim: several triangles of a fine mesh."""

Radii = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""(n, 3) unit directions -> (n,) radii, 0 where nothing is met, and (n, 3) their gradients."""


def continue_beyond_rim(directions: np.ndarray, radii: np.ndarray, gradients: np.ndarray, radii_of: Radii) -> None:
    """Give directions that meet nothing, but are no farther than ``RIM`` from one that does, continued values.

    Args:
        directions: (n, 3) float64 unit directions.
        radii: (n,) float64 in these, 0 where nothing is met. They and ``gradients``, (n, 3), are changed.
        radii_of: what finds them in other directions.
    """
    is_met = radii > 0.0
    if is_met.all() or not is_met.any():
        return
    missing, met = np.flatnonzero(~is_met), np.flatnonzero(is_met)
    distances, nearest = cKDTree(directions[met]).query(directions[missing], distance_upper_bound=RIM)
    beyond, rim = missing[np.isfinite(distances)], met[nearest[np.isfinite(distances)]]
    at, steps = directions[rim], 2.0 * np.arcsin(distances[np.isfinite(distances)] / 2.0)[:, None]
    onwards = directions[beyond] - np.cos(steps) * at
    onwards /= np.linalg.norm(onwards, axis=1, keepdims=True)
    aside = np.cross(at, onwards)
    before = np.cos(INSIDE) * at - np.sin(INSIDE) * onwards
    onwards_before = np.cos(INSIDE) * onwards + np.sin(INSIDE) * at
    slope, slope_aside = _slopes(radii[rim], gradients[rim], onwards, aside)
    radii_before, gradients_before = radii_of(before)
    has_before = (radii_before > 0.0)[:, None]
    earlier, earlier_aside = _slopes(
        np.where(radii_before > 0.0, radii_before, 1.0), gradients_before, onwards_before, aside
    )
    bend = np.where(has_before, slope - earlier, 0.0) / INSIDE
    bend_aside = np.where(has_before, slope_aside - earlier_aside, 0.0) / INSIDE
    radii[beyond] = radii[rim] * np.exp(slope * steps + 0.5 * bend * steps**2)[:, 0]
    onwards_beyond = np.cos(steps) * onwards - np.sin(steps) * at
    relative = (slope + bend * steps) * onwards_beyond + (slope_aside + bend_aside * steps) * aside
    gradients[beyond] = radii[beyond, None] * relative


def _slopes(
    radii: np.ndarray, gradients: np.ndarray, onwards: np.ndarray, aside: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 1) each: derivatives of log r in two directions."""
    relative = gradients / radii[:, None]
    ahead, across = (np.einsum("ij,ij->i", relative, way)[:, None] for way in (onwards, aside))
    return ahead, across
