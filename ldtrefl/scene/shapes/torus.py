"""A torus."""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Around, Fraction, bytes_with_normals, shape
from ldtrefl.scene.shapes.surfaces import parametric, points


@shape(
    needed_bytes=lambda minor, segments: bytes_with_normals(2 * segments[0] * segments[1]),
    smaller=("segments",),
    is_closed=True,
    reach=1.35,
)
def torus(minor: Fraction = 0.35, segments: tuple[Around, Around] = (192, 96)) -> Mesh:
    """About z, radii 1 and ``minor``."""

    def ring(u: np.ndarray) -> np.ndarray:
        return points(np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), 0 * u)

    def normal(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        around, up = np.cos(2 * np.pi * v)[..., None], np.sin(2 * np.pi * v)[..., None]
        return around * ring(u) + up * np.array([0.0, 0.0, 1.0])

    return parametric(lambda u, v: ring(u) + minor * normal(u, v), *segments, wrap_u=True, wrap_v=True, normal=normal)
