"""A sphere."""

from __future__ import annotations

import numpy as np

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Around, Segments, bytes_with_normals, shape
from ldtrefl.scene.shapes.surfaces import parametric, points


@shape(
    needed_bytes=lambda segments: bytes_with_normals(2 * segments[0] * segments[1]),
    smaller=("segments",),
    is_closed=True,
)
def sphere(segments: tuple[Around, Segments] = (192, 96)) -> Mesh:
    """Radius 1; segments around and from pole to pole."""

    def position(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        polar = np.pi * (1.0 - v)
        ring = np.where((v == 0.0) | (v == 1.0), 0.0, np.sin(polar))
        return points(ring * np.cos(2 * np.pi * u), ring * np.sin(2 * np.pi * u), np.cos(polar))

    return parametric(position, *segments, wrap_u=True, normal=position)
