"""Pieces of a surface, which patches (``patches.py``) are made of: parallelograms; and cells about them."""

from __future__ import annotations

import warp as wp

LARGE = wp.constant(4)
"""Added to the kind of a patch whose triangle is larger than its texel."""


@wp.struct
class Piece:
    """A corner, and the two edges from it."""

    corner: wp.vec3  # in cells of the survey
    edge_u: wp.vec3
    edge_v: wp.vec3
    kind: int  # the axis of its map, 0 to 2, and ``LARGE``
    triangle: int


@wp.func
def low_corner(piece: Piece) -> wp.vec3:
    """Of the box about a piece."""
    none = wp.vec3(0.0)
    return piece.corner + wp.min(piece.edge_u, none) + wp.min(piece.edge_v, none)


@wp.func
def high_corner(piece: Piece) -> wp.vec3:
    """Of the box about a piece."""
    none = wp.vec3(0.0)
    return piece.corner + wp.max(piece.edge_u, none) + wp.max(piece.edge_v, none)


@wp.func
def cell_number(x: float, cells: int) -> int:
    """The cell that holds a coordinate; the nearest if none does."""
    return wp.clamp(int(wp.floor(x)), 0, cells - 1)


@wp.func
def number_of_cell(cells: wp.vec3i, x: int, y: int, z: int) -> int:
    """Number of a cell among all, row by row."""
    return (z * cells[1] + y) * cells[0] + x
