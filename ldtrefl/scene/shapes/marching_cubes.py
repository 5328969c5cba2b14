"""Surfaces that a function of space defines, by marching cubes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.surfaces import fitted, outwards


def implicit(field: Callable[..., np.ndarray], extent: tuple[float, float, float], grid: int) -> Mesh:
    """The surface ``field = 0``, fitted in the cube from -1 to 1.

    Args:
        field: coordinates x, y and z, each (i, j, k) -> (i, j, k), positive inside.
        extent: half the sides of the box about 0 that is searched.
        grid: cells along its longest side.
    """
    from skimage import measure  # noqa: PLC0415  a tenth of a second

    cell = 2.0 * max(extent) / grid
    counts = [int(np.ceil(2.0 * side / cell)) + 1 for side in extent]
    axes = [(np.arange(n) - (n - 1) / 2.0) * cell for n in counts]
    values = field(*np.meshgrid(*axes, indexing="ij"))
    vertices, faces, _, _ = measure.marching_cubes(values, 0.0, spacing=(cell, cell, cell))
    return outwards(fitted(Mesh(vertices, faces)))
