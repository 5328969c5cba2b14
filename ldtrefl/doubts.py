"""Where patches do not follow the surface: there its triangles are kept.

A patch is the plane of one triangle over a texel. Where a surface is smooth at the scale of texels, neighbours in a map
go on into each other, and a patch is off by about the angle between them, times its side, over three. Where they do not
(the surface is rough, bent within a few texels, ends, or has an edge), a patch may be off by a texel: it is *doubtful*,
and so are the cells that it lies in. No patch is kept there, and every triangle is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.binning import bin_items
from ldtrefl.cubemap import TexelFrame
from ldtrefl.grid import BRICK, CELLS, cell_number, number_of_cell
from ldtrefl.launch import kernel, launch
from ldtrefl.patches import FACING, Piece

LARGEST_END = wp.constant(0.25)
"""|n . axis| above ``FACING`` up to which a missing neighbour can be a surface that goes on in another map, and not an
edge: with more, fast patches stuck out over the edges of a box."""


@wp.struct
class PatchMap:
    """Patches, texel by texel."""

    patches: wp.array(dtype=Piece)
    texel: wp.array(dtype=wp.int32)  # of each patch
    start: wp.array(dtype=wp.int32)  # first patch of each texel, the three axes' maps in a row
    size: wp.vec3i  # texels
    first_texel: wp.vec3i
    cells_per_texel: float
    bricks: wp.vec3i


@wp.func
def goes_on(maps: PatchMap, middle: wp.vec3, normal: wp.vec3, texel: int, largest_turn: float) -> int:
    """1 if a patch of a texel goes on where a plane leads, 0 if there is none near it, -1 if the nearest is turned or
    offset."""
    # All by squares: the lengths of normals are areas.
    nearest = 0.25 * maps.cells_per_texel * maps.cells_per_texel
    largest = largest_turn * largest_turn
    square = wp.dot(normal, normal)
    answer = int(0)
    for k in range(maps.start[texel], maps.start[texel + 1]):
        edge_u, edge_v = maps.patches[k].edge_u, maps.patches[k].edge_v
        other = wp.cross(edge_u, edge_v)
        height = wp.dot(normal, maps.patches[k].corner + 0.5 * (edge_u + edge_v) - middle)
        away = height * height / square
        if away < nearest and wp.dot(normal, other) > 0.0:
            nearest = away
            across = wp.cross(normal, other)
            turn = wp.dot(across, across) / (square * wp.dot(other, other))
            fits = turn <= largest and away <= largest * maps.cells_per_texel * maps.cells_per_texel
            answer = wp.where(fits, 1, -1)
    return answer


@kernel
def sort_patches(
    first: int,
    # In:
    patches: wp.array(dtype=Piece),
    texel: wp.array(dtype=wp.int32),
    places: wp.array(dtype=wp.int32),
    # Out:
    patches_out: wp.array(dtype=Piece),
    texel_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    patches_out[places[i]] = patches[i]
    texel_out[places[i]] = texel[i]


@kernel
def find_doubts(
    first: int,
    # In:
    maps: PatchMap,
    largest_turn: float,
    # Out: 1 for doubtful patches; 1 for doubtful cells, the same value from whoever writes
    patch_out: wp.array(dtype=wp.uint8),
    cell_out: wp.array(dtype=wp.uint8),
):
    i = first + wp.tid()
    piece = maps.patches[i]
    middle = piece.corner + 0.5 * (piece.edge_u + piece.edge_v)
    normal = wp.cross(piece.edge_u, piece.edge_v)
    texel = maps.texel[i]
    axis = wp.where(texel < maps.first_texel[1], 0, wp.where(texel < maps.first_texel[2], 1, 2))
    columns, rows = maps.size[(axis + 1) % 3], maps.size[(axis + 2) % 3]
    u, v = (texel - maps.first_texel[axis]) % columns, (texel - maps.first_texel[axis]) / columns
    # A surface that turns on as it may goes on in another map.
    may_end = wp.abs(normal[axis]) < (FACING + wp.min(largest_turn, LARGEST_END)) * wp.length(normal)
    doubtful = bool(False)
    for side in range(4):
        u_beside = u + wp.where(side == 0, 1, 0) - wp.where(side == 1, 1, 0)
        v_beside = v + wp.where(side == 2, 1, 0) - wp.where(side == 3, 1, 0)
        following = int(0)
        if not doubtful and u_beside >= 0 and u_beside < columns and v_beside >= 0 and v_beside < rows:
            beside = maps.first_texel[axis] + v_beside * columns + u_beside
            if side == 0 or side == 2:
                following = goes_on(maps, middle, normal, beside, largest_turn)
            else:
                # The neighbour compares itself with this one.
                following = wp.where(maps.start[beside] < maps.start[beside + 1], 1, 0)
        doubtful = doubtful or following < 0 or (following == 0 and not may_end)
    patch_out[i] = wp.where(doubtful, wp.uint8(1), wp.uint8(0))
    if doubtful:
        nx, ny, nz = BRICK * maps.bricks[0], BRICK * maps.bricks[1], BRICK * maps.bricks[2]
        for k in range(5):
            p = middle
            if k < 4:
                p = piece.corner + float(k % 2) * piece.edge_u + float(k / 2) * piece.edge_v
            x, y, z = cell_number(p[0], nx), cell_number(p[1], ny), cell_number(p[2], nz)
            cell_out[number_of_cell(maps.bricks, x, y, z)] = wp.uint8(1)


@kernel
def find_near(
    first: int,
    # In:
    doubtful: wp.array(dtype=wp.uint8),
    bricks: wp.vec3i,
    # Out: 1 for cells beside a doubtful one, and for those
    near_out: wp.array(dtype=wp.uint8),
):
    brick = first + wp.tid()
    nx, ny, nz = BRICK * bricks[0], BRICK * bricks[1], BRICK * bricks[2]
    corner_x = BRICK * (brick % bricks[0])
    corner_y = BRICK * ((brick / bricks[0]) % bricks[1])
    corner_z = BRICK * (brick / (bricks[0] * bricks[1]))
    for k in range(CELLS):
        if doubtful[CELLS * brick + k] != wp.uint8(0):
            x, y, z = corner_x + k % BRICK, corner_y + (k / BRICK) % BRICK, corner_z + k / (BRICK * BRICK)
            for dz in range(wp.max(z - 1, 0), wp.min(z + 2, nz)):
                for dy in range(wp.max(y - 1, 0), wp.min(y + 2, ny)):
                    for dx in range(wp.max(x - 1, 0), wp.min(x + 2, nx)):
                        near_out[number_of_cell(bricks, dx, dy, dz)] = wp.uint8(1)


@dataclass(frozen=True, eq=False)
class Doubts:
    """Where patches are in doubt."""

    patches: wp.array
    """(n,) ``Piece``, texel by texel."""
    share: float
    """Of all patches, those in doubt."""
    cells: wp.array
    """(cells,) uint8, 1 for doubtful ones."""
    near: wp.array
    """(cells,) uint8, 1 for those and the cells beside them."""


def no_doubts(patches: wp.array, bricks: wp.vec3i) -> Doubts:
    """All patches are good enough."""
    nothing = wp.empty(0, dtype=wp.uint8, device=patches.device)
    cells = bricks[0] * bricks[1] * bricks[2] * int(CELLS)
    return Doubts(patches, 0.0, nothing, wp.zeros(cells, dtype=wp.uint8, device=patches.device))


def doubts_of(
    frame: TexelFrame,
    cells_per_texel: float,
    bricks: wp.vec3i,
    patches: wp.array,
    texel: wp.array,
    largest_turn: float,
) -> Doubts:
    """Compare every patch with its neighbours.

    Args:
        patches: (n,) ``Piece``.
        texel: (n,) int32, the texel of each.
        largest_turn: radians between neighbours from which they are in doubt.
    """
    device, count = patches.device, patches.shape[0]
    maps = PatchMap()
    maps.start, places = bin_items(texel, frame.first_texels[3], device)
    maps.patches, maps.texel = wp.empty_like(patches), wp.empty_like(texel)
    launch(sort_patches, count, [patches, texel, places, maps.patches, maps.texel], device)
    maps.size, maps.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
    maps.cells_per_texel, maps.bricks = cells_per_texel, bricks
    doubtful = wp.empty(count, dtype=wp.uint8, device=device)
    brick_count = bricks[0] * bricks[1] * bricks[2]
    cells, near = (wp.zeros(brick_count * int(CELLS), dtype=wp.uint8, device=device) for _ in range(2))
    launch(find_doubts, count, [maps, largest_turn, doubtful, cells], device)
    launch(find_near, brick_count, [cells, bricks, near], device)
    return Doubts(maps.patches, int(np.count_nonzero(doubtful.numpy())) / count, cells, near)
