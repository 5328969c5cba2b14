"""A square."""

from __future__ import annotations

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Segments, bytes_with_normals, shape
from ldtrefl.scene.shapes.surfaces import rectangle


@shape(
    needed_bytes=lambda segments: bytes_with_normals(2 * segments**2),
    smaller=("segments",),
    is_closed=False,
)
def plane(segments: Segments = 1) -> Mesh:
    """-1 to 1 in x and y, facing +z."""
    return rectangle([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], segments)
