"""A disc with three holes."""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Grid, bytes_by_marching_cubes, shape
from ldtrefl.scene.shapes.marching_cubes import implicit


@shape(
    needed_bytes=lambda grid: bytes_by_marching_cubes(0.5 * grid**3, 4.5 * grid**2),
    smaller=("grid",),
    is_closed=True,
)
def genus3(grid: Grid = 96) -> Mesh:
    """A rounded disc with three holes: the implicit surface z^2 = k f(x, y), f positive between rim and holes."""
    holes = [(0.52 * np.cos(a), 0.52 * np.sin(a)) for a in np.pi / 2 + np.arange(3) * 2 * np.pi / 3]

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        f = 1.0 - x**2 - y**2
        for cx, cy in holes:
            distance = (x - cx) ** 2 + (y - cy) ** 2
            f = f * (distance - 0.24**2) / (distance + 0.24**2)
        return 0.14 * f - z**2

    return implicit(field, (1.1, 1.1, 0.5), grid)
