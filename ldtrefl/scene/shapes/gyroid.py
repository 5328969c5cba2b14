"""A gyroid's sheet, cut by a ball."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Grid, bytes_by_marching_cubes, shape
from ldtrefl.scene.shapes.marching_cubes import implicit


@shape(
    needed_bytes=lambda periods, grid: bytes_by_marching_cubes(grid**3, (4.0 + 9.0 * periods) * grid**2),
    smaller=("periods", "grid"),
    is_closed=True,
)
def gyroid(periods: Annotated[float, Field(strict=True, gt=0, le=8)] = 1.5, grid: Grid = 128) -> Mesh:
    """A gyroid's sheet, given a thickness and cut by a ball: closed, of high genus, with deep layers."""

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        k = np.pi * periods
        g = np.sin(k * x) * np.cos(k * y) + np.sin(k * y) * np.cos(k * z) + np.sin(k * z) * np.cos(k * x)
        return np.minimum(0.4 - np.abs(g), k * (1.0 - np.sqrt(x**2 + y**2 + z**2)))

    return implicit(field, (1.1, 1.1, 1.1), grid)
