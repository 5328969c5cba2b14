"""A box with a square hole through it."""

from __future__ import annotations

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.shapes.base import Fraction, Segments, bytes_with_normals, shape
from ldtrefl.scene.shapes.surfaces import joined, rectangle


@shape(
    needed_bytes=lambda hole, segments: bytes_with_normals(32 * segments**2),
    smaller=("segments",),
    is_closed=True,
)
def hollow_box(hole: Fraction = 0.6, segments: Segments = 1) -> Mesh:
    """A box from -1 to 1 with a square hole of half-width ``hole`` through it, along z."""
    ring = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    sides = []
    for k in range(4):
        (ax, ay), (bx, by) = ring[k], ring[(k + 1) % 4]
        sides.append(rectangle([[ax, ay, -1], [bx, by, -1], [bx, by, 1], [ax, ay, 1]], segments))
        h = hole
        sides.append(
            rectangle([[h * bx, h * by, -1], [h * ax, h * ay, -1], [h * ax, h * ay, 1], [h * bx, h * by, 1]], segments)
        )
        top = [[ax, ay, 1], [bx, by, 1], [h * bx, h * by, 1], [h * ax, h * ay, 1]]
        sides.append(rectangle(top, segments))
        sides.append(rectangle([[x, y, -1] for x, y, _ in top[::-1]], segments))
    return joined(*sides)
