"""A box seen from inside."""

from __future__ import annotations

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Segments, bytes_with_normals, shape
from ldtrefl.scene.shapes.surfaces import box_sides, joined


@shape(
    needed_bytes=lambda segments: bytes_with_normals(12 * segments**2),
    smaller=("segments",),
    is_closed=True,
    inwards=True,
)
def room(segments: Segments = 1) -> Mesh:
    """A box seen from inside."""
    return joined(*box_sides(segments, inwards=True))
