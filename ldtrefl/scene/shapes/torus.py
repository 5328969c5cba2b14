"""A torus."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Around, Fraction, bytes_with_normals, shape
from ldtrefl.scene.shapes.surfaces import parametric, points


@shape(
    needed_bytes=lambda minor, arc, segments: bytes_with_normals(2 * segments[0] * segments[1]),
    smaller=("segments",),
    is_closed=True,
    reach=1.35,
)
def torus(
    minor: Fraction = 0.35,
    arc: Annotated[float, Field(strict=True, gt=0.0, le=360.0)] = 360.0,
    segments: tuple[Around, Around] = (192, 96),
) -> Mesh:
    """About z, radii 1 and ``minor``; of less than 360 degrees the bent tube from +x on, open at its ends."""
    turn = np.radians(arc)

    def ring(u: np.ndarray) -> np.ndarray:
        return points(np.cos(turn * u), np.sin(turn * u), 0 * u)

    def normal(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        around, up = np.cos(2 * np.pi * v)[..., None], np.sin(2 * np.pi * v)[..., None]
        return around * ring(u) + up * np.array([0.0, 0.0, 1.0])

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return ring(u) + minor * normal(u, v)

    return parametric(position, *segments, wrap_u=arc == 360.0, wrap_v=True, normal=normal)
