"""Pieces of a surface, and cells about them: what a record of the tree is made from.

A piece is a triangle of the mesh, or a patch (``patches.py``): a parallelogram.
"""

from __future__ import annotations

import warp as wp

TRIANGLE = wp.constant(-1)
"""Kind of a piece that is a triangle; a patch's is the axis of its map, 0 to 2."""
LARGE = wp.constant(4)
"""Added to the kind of a patch whose triangle is larger than its texel."""


@wp.struct
class Piece:
    """A corner, and the two edges from it."""

    corner: wp.vec3  # a patch's in cells of the survey
    edge_u: wp.vec3
    edge_v: wp.vec3
    kind: int
    triangle: int


@wp.func
def low_corner(piece: Piece) -> wp.vec3:
    """Of the box about a piece."""
    b, c = piece.corner + piece.edge_u, piece.corner + piece.edge_v
    low = wp.min(piece.corner, wp.min(b, c))
    if piece.kind > TRIANGLE:
        low = wp.min(low, b + piece.edge_v)
    return low


@wp.func
def high_corner(piece: Piece) -> wp.vec3:
    """Of the box about a piece."""
    b, c = piece.corner + piece.edge_u, piece.corner + piece.edge_v
    high = wp.max(piece.corner, wp.max(b, c))
    if piece.kind > TRIANGLE:
        high = wp.max(high, b + piece.edge_v)
    return high


@wp.func
def cell_number(x: float, cells: int) -> int:
    """The cell that holds a coordinate; the nearest if none does."""
    return wp.clamp(int(wp.floor(x)), 0, cells - 1)


@wp.func
def number_of_cell(cells: wp.vec3i, x: int, y: int, z: int) -> int:
    """Number of a cell among all, row by row."""
    return (z * cells[1] + y) * cells[0] + x
