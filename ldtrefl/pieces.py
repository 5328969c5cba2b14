"""Pieces of a surface, and the cells that they touch: what a record of the grid is made from.

A piece is a triangle of the mesh, or a patch (``patches.py``): a parallelogram.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.grid import TRIANGLE, cell_number

CELL_MARGIN = wp.constant(1.0e-3)
"""Cells by which cells are widened when records are put into them, for the rounding of rays."""
SUBCELLS = wp.constant(64)
"""Parts of a cell, 4 x 4 x 4, in whose order its records stand, so that the 8 of a block lie together."""


@wp.struct
class Piece:
    """A corner, and the two edges from it."""

    corner: wp.vec3  # cell space, a patch's that of the survey
    edge_u: wp.vec3
    edge_v: wp.vec3
    kind: int  # of ``grid.py``
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
def is_apart(axis: wp.vec3, piece: Piece, half: float) -> bool:
    """Whether an axis separates a piece from the cube about 0."""
    p = wp.dot(axis, piece.corner)
    u, v = wp.dot(axis, piece.edge_u), wp.dot(axis, piece.edge_v)
    low = p + wp.min(0.0, wp.min(u, v))
    high = p + wp.max(0.0, wp.max(u, v))
    if piece.kind > TRIANGLE:
        low = wp.min(low, p + u + v)
        high = wp.max(high, p + u + v)
    reach = half * (wp.abs(axis[0]) + wp.abs(axis[1]) + wp.abs(axis[2]))
    return low > reach or high < -reach


@wp.func
def edges_are_apart(edge: wp.vec3, piece: Piece, half: float) -> bool:
    """Whether a cross product of this edge with a side of the cube separates them."""
    return (
        is_apart(wp.vec3(0.0, -edge[2], edge[1]), piece, half)
        or is_apart(wp.vec3(edge[2], 0.0, -edge[0]), piece, half)
        or is_apart(wp.vec3(-edge[1], edge[0], 0.0), piece, half)
    )


@wp.func
def touches_cell(piece: Piece, x: int, y: int, z: int) -> bool:
    """Separating-axis test of a piece against a cell whose box it is known to meet (Akenine-Moeller 2001)."""
    half = 0.5 + CELL_MARGIN
    local = Piece()
    local.corner = piece.corner - wp.vec3(float(x) + 0.5, float(y) + 0.5, float(z) + 0.5)
    local.edge_u = piece.edge_u
    local.edge_v = piece.edge_v
    local.kind = piece.kind
    if is_apart(wp.cross(piece.edge_u, piece.edge_v), local, half):
        return False
    if edges_are_apart(piece.edge_u, local, half) or edges_are_apart(piece.edge_v, local, half):
        return False
    return piece.kind > TRIANGLE or not edges_are_apart(piece.edge_v - piece.edge_u, local, half)


@wp.func
def subcell(piece: Piece, x: int, y: int, z: int) -> int:
    """The part of a cell that holds the middle of what lies of a piece in it, in Morton order."""
    corner = wp.vec3(float(x), float(y), float(z))
    low, high = wp.max(low_corner(piece), corner), wp.min(high_corner(piece), corner + wp.vec3(1.0))
    middle = 0.5 * (low + high) - corner
    u, v, w = cell_number(4.0 * middle[0], 4), cell_number(4.0 * middle[1], 4), cell_number(4.0 * middle[2], 4)
    return 32 * (w / 2) + 16 * (v / 2) + 8 * (u / 2) + 4 * (w % 2) + 2 * (v % 2) + u % 2
