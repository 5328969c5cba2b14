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

from ldtrefl.binning import CHUNK, bin_items, chunk_count, gather_lists, launch_chunks
from ldtrefl.launch import kernel, launch
from ldtrefl.patches import FACING, Survey
from ldtrefl.pieces import Piece, cell_number, high_corner, low_corner, number_of_cell

LARGEST_END = wp.constant(0.25)
"""|n . axis| above ``FACING`` up to which a missing neighbour can be a surface that goes on in another map, and not an
edge: with more, fast patches stuck out over the edges of a box."""


@wp.struct
class PatchCells:
    """The cells of the survey in the box about a patch, which is smaller than a cell."""

    first: wp.vec3i
    last: wp.vec3i


@wp.func
def cells_of_patch(cells: wp.vec3i, piece: Piece) -> PatchCells:
    """The cells in the box about a patch."""
    low, high = low_corner(piece), high_corner(piece)
    box = PatchCells()
    for axis in range(3):
        box.first[axis] = cell_number(low[axis], cells[axis])
        box.last[axis] = cell_number(high[axis], cells[axis])
    return box


@wp.func
def crosses_cell(piece: Piece, x: int, y: int, z: int) -> bool:
    """Whether the plane of a patch crosses a cell."""
    normal = wp.cross(piece.edge_u, piece.edge_v)
    middle = wp.vec3(float(x) + 0.5, float(y) + 0.5, float(z) + 0.5)
    reach = 0.5 * (wp.abs(normal[0]) + wp.abs(normal[1]) + wp.abs(normal[2]))
    return wp.abs(wp.dot(normal, middle - piece.corner)) <= reach


@wp.struct
class PatchMap:
    """Patches, texel by texel."""

    patches: wp.array(dtype=Piece)
    texel: wp.array(dtype=wp.int32)  # of each patch
    start: wp.array(dtype=wp.int32)  # first patch of each texel, the three axes' maps in a row
    size: wp.vec3i  # texels
    first_texel: wp.vec3i
    cells_per_texel: float
    cells: wp.vec3i


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
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    # Out:
    patches_out: wp.array(dtype=Piece),
    texel_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    place = start[texel[i]] + ranks[i]
    patches_out[place] = patches[i]
    texel_out[place] = texel[i]


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
        box = cells_of_patch(maps.cells, piece)
        for z in range(box.first[2], box.last[2] + 1):
            for y in range(box.first[1], box.last[1] + 1):
                for x in range(box.first[0], box.last[0] + 1):
                    cell_out[number_of_cell(maps.cells, x, y, z)] = wp.uint8(1)


@kernel
def find_near(
    first: int,
    # In:
    doubtful: wp.array(dtype=wp.uint8),
    cells: wp.vec3i,
    # Out: 1 for cells beside a doubtful one, and for those
    near_out: wp.array(dtype=wp.uint8),
):
    i = first + wp.tid()
    if doubtful[i] == wp.uint8(0):
        return
    x, y, z = i % cells[0], (i / cells[0]) % cells[1], i / (cells[0] * cells[1])
    for z_beside in range(wp.max(z - 1, 0), wp.min(z + 2, cells[2])):
        for y_beside in range(wp.max(y - 1, 0), wp.min(y + 2, cells[1])):
            for x_beside in range(wp.max(x - 1, 0), wp.min(x + 2, cells[0])):
                near_out[number_of_cell(cells, x_beside, y_beside, z_beside)] = wp.uint8(1)


@kernel
def list_sure(
    first: int,
    # In:
    patches: wp.array(dtype=Piece),
    doubtful: wp.array(dtype=wp.uint8),  # cells; empty: none is
    cells: wp.vec3i,
    # Out, per chunk: patches outside doubtful cells, and their list as items; 1 for cells with one of them, the same
    # value from whoever writes
    count_out: wp.array(dtype=wp.int32),
    list_out: wp.array(dtype=wp.int32),
    touched_out: wp.array(dtype=wp.uint8),
):
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    count = int(0)
    for i in range(begin, wp.min(begin + CHUNK, patches.shape[0])):
        box = cells_of_patch(cells, patches[i])
        is_sure = bool(True)
        if doubtful.shape[0] > 0:
            for z in range(box.first[2], box.last[2] + 1):
                for y in range(box.first[1], box.last[1] + 1):
                    for x in range(box.first[0], box.last[0] + 1):
                        if doubtful[number_of_cell(cells, x, y, z)] != wp.uint8(0):
                            is_sure = False
        if is_sure:
            list_out[begin + count] = -1 - i
            count += 1
            for z in range(box.first[2], box.last[2] + 1):
                for y in range(box.first[1], box.last[1] + 1):
                    for x in range(box.first[0], box.last[0] + 1):
                        if crosses_cell(patches[i], x, y, z):
                            touched_out[number_of_cell(cells, x, y, z)] = wp.uint8(1)
    count_out[chunk] = count


@dataclass(frozen=True, eq=False)
class Doubts:
    """Where patches are in doubt."""

    patches: wp.array
    """(n,) ``Piece``."""
    share: float
    """Of all patches, those in doubt."""
    cells: wp.array
    """(cells,) uint8, 1 for doubtful cells of the survey; empty if none is."""
    near: wp.array
    """(cells,) uint8, 1 for those and the cells beside them."""
    survey_cells: wp.vec3i

    def sure_patches(self) -> tuple[wp.array, wp.array]:
        """The patches outside doubtful cells as items, -1 for patch 0; and (cells,) uint8, 1 for their cells."""
        device, count = self.patches.device, self.patches.shape[0]
        counts = wp.zeros(chunk_count(count) + 1, dtype=wp.int32, device=device)
        listed, touched = wp.empty(count, dtype=wp.int32, device=device), wp.zeros_like(self.near)
        inputs = [self.patches, self.cells, self.survey_cells, counts, listed, touched]
        launch_chunks(list_sure, count, inputs, device)
        return gather_lists(listed, counts), touched


def no_doubts(survey: Survey) -> Doubts:
    """All patches are good enough."""
    patches, _ = survey.patches()
    nx, ny, nz = survey.cells
    nothing = wp.empty(0, dtype=wp.uint8, device=patches.device)
    return Doubts(patches, 0.0, nothing, wp.zeros(nx * ny * nz, dtype=wp.uint8, device=patches.device), survey.cells)


def doubts_of(survey: Survey, largest_turn: float) -> Doubts:
    """Compare every patch with its neighbours; ``largest_turn`` in radians is when they are in doubt."""
    frame, (patches, texel) = survey.frame, survey.patches()
    device, count = patches.device, patches.shape[0]
    maps = PatchMap()
    maps.start, ranks = bin_items(texel, frame.first_texels[3], device)
    maps.patches, maps.texel = wp.empty_like(patches), wp.empty_like(texel)
    launch(sort_patches, count, [patches, texel, maps.start, ranks, maps.patches, maps.texel], device)
    maps.size, maps.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
    maps.cells_per_texel, maps.cells = survey.cells_per_texel, survey.cells
    doubtful = wp.empty(count, dtype=wp.uint8, device=device)
    cell_count = survey.cells[0] * survey.cells[1] * survey.cells[2]
    cells, near = (wp.zeros(cell_count, dtype=wp.uint8, device=device) for _ in range(2))
    launch(find_doubts, count, [maps, largest_turn, doubtful, cells], device)
    doubts = int(np.count_nonzero(doubtful.numpy()))
    if doubts == 0:
        return Doubts(maps.patches, 0.0, wp.empty(0, dtype=wp.uint8, device=device), near, survey.cells)
    launch(find_near, cell_count, [cells, survey.cells, near], device)
    return Doubts(maps.patches, doubts / count, cells, near, survey.cells)
