"""Where patches do not follow the surface: there its triangles are kept.

A patch is the plane of one triangle over a texel. Where a surface is smooth at the scale of texels, neighbours in a map
go on into each other; where it turns out of what one map faces, another map goes on. Its planes are then moved to the
mean height of the surface over their texels. Where neighbours do not go on (the surface is rough, bent within a few
texels, ends, or has an edge), a patch may be off by a texel: it is *doubtful*, and so are the cells that it lies in. No
patch is kept there, and every triangle is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device.bins import CHUNK, bin_items, chunk_count, gather_lists, launch_chunks
from ldtrefl.device.launch import kernel, launch
from ldtrefl.ldt.exact.patches import Survey
from ldtrefl.ldt.exact.pieces import Piece, cell_number, high_corner, low_corner, number_of_cell
from ldtrefl.ldt.texel_frame import point_from_texel

RISE_PER_TURN = wp.constant(1.12 / 24.0)
"""Of the summed heights of the four neighbours' middles over a patch's plane, the mean height over the patch of the
paraboloid through them: x^2 / 2 is a 24th of a side's square on average, and a patch is a little wider than a texel."""


REACH = wp.constant(1.0)
"""Sides of a patch from its plane within which a neighbour is looked for."""
OFF_BESIDE = wp.constant(0.5)
"""Sides that a neighbour may lie off the plane per radian that it may be turned: the chord of an arc."""
OFF_ELSEWHERE = wp.constant(1.0)
"""The same in another map, where it lies up to 1.8 sides away."""
AHEAD = wp.constant(0.6)
"""Of a step to the next texel, how far ahead a neighbour in another map must lie: a surface that goes on so far ends
behind the patch's margin."""


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
class PatchPlane:
    """The plane of a patch, in cells."""

    middle: wp.vec3
    normal: wp.vec3  # unit


@wp.struct
class PatchMap:
    """Patches, texel by texel."""

    patches: wp.array(dtype=Piece)
    planes: wp.array(dtype=PatchPlane)
    texel: wp.array(dtype=wp.int32)  # of each patch
    start: wp.array(dtype=wp.int32)  # first patch of each texel, the three axes' maps in a row
    size: wp.vec3i  # texels
    first_texel: wp.vec3i
    cells_per_texel: float
    cells: wp.vec3i


@wp.struct
class Neighbour:
    """What a map holds beside a patch."""

    follows: int  # 1 if the surface goes on where the patch's plane leads, 0 if there is none, -1 if turned or offset
    height: float  # over the plane, cells
    is_beside: bool  # in the same map


@wp.func
def neighbour_of(
    maps: PatchMap, middle: wp.vec3, normal: wp.vec3, ahead: wp.vec3, texel: int, largest_turn: float, off: float
) -> Neighbour:
    """The patch of a texel that is nearest to a plane, faces the same way, and lies ``ahead`` of the plane's middle, or
    anywhere if that is 0; ``off`` sides off the plane are allowed per radian."""
    nearest = REACH * maps.cells_per_texel
    allowed = off * largest_turn * maps.cells_per_texel
    found = Neighbour()
    for k in range(maps.start[texel], maps.start[texel + 1]):
        other = maps.planes[k]
        apart = other.middle - middle
        height = wp.dot(normal, apart)
        cosine = wp.dot(normal, other.normal)
        if wp.abs(height) < nearest and cosine > 0.0 and wp.dot(apart, ahead) >= AHEAD * wp.dot(ahead, ahead):
            nearest = wp.abs(height)
            fits = 1.0 - cosine * cosine <= largest_turn * largest_turn and nearest <= allowed
            found.follows = wp.where(fits, 1, -1)
            found.height = height
    found.is_beside = True
    return found


@wp.func
def neighbour_elsewhere(
    maps: PatchMap, axis: int, middle: wp.vec3, normal: wp.vec3, ahead: wp.vec3, largest_turn: float
) -> Neighbour:
    """The patch that one of the other two maps holds near the point ``ahead`` of a plane's middle."""
    found = Neighbour()
    point = (middle + ahead) / maps.cells_per_texel
    for k in range(1, 3):
        other = (axis + k) % 3
        columns, rows = maps.size[(other + 1) % 3], maps.size[(other + 2) % 3]
        # The four texels whose middles are nearest.
        first_u = int(wp.floor(point[(other + 1) % 3] - 0.5))
        first_v = int(wp.floor(point[(other + 2) % 3] - 0.5))
        for v in range(wp.max(first_v, 0), wp.min(first_v + 2, rows)):
            for u in range(wp.max(first_u, 0), wp.min(first_u + 2, columns)):
                if found.follows <= 0:
                    texel = maps.first_texel[other] + v * columns + u
                    there = neighbour_of(maps, middle, normal, ahead, texel, largest_turn, OFF_ELSEWHERE)
                    if there.follows != 0:
                        found = there
    found.is_beside = False
    return found


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
    planes_out: wp.array(dtype=PatchPlane),
    texel_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    place = start[texel[i]] + ranks[i]
    piece = patches[i]
    plane = PatchPlane()
    plane.middle = piece.corner + 0.5 * (piece.edge_u + piece.edge_v)
    plane.normal = wp.normalize(wp.cross(piece.edge_u, piece.edge_v))
    patches_out[place] = piece
    planes_out[place] = plane
    texel_out[place] = texel[i]


@wp.func
def neighbour_onwards(
    maps: PatchMap, axis: int, texel: wp.vec2i, way: wp.vec2i, middle: wp.vec3, normal: wp.vec3, largest_turn: float
) -> Neighbour:
    """The patch a texel further in a patch's map, where there is none in another map."""
    columns, rows = maps.size[(axis + 1) % 3], maps.size[(axis + 2) % 3]
    u, v = texel[0] + way[0], texel[1] + way[1]
    found = Neighbour()
    if u >= 0 and u < columns and v >= 0 and v < rows:
        beside = maps.first_texel[axis] + v * columns + u
        found = neighbour_of(maps, middle, normal, wp.vec3(0.0), beside, largest_turn, OFF_BESIDE)
    if found.follows == 0:
        du, dv = float(way[0]), float(way[1])
        rise = -(du * normal[(axis + 1) % 3] + dv * normal[(axis + 2) % 3]) / normal[axis]
        ahead = maps.cells_per_texel * point_from_texel(axis, wp.vec3(du, dv, rise))
        found = neighbour_elsewhere(maps, axis, middle, normal, ahead, largest_turn)
    return found


@kernel
def find_doubts(
    first: int,
    # In:
    maps: PatchMap,
    largest_turn: float,
    # Out, per patch: 1 for a doubtful one; the mean height of the surface over it, cells; the sum of the squares of the
    # surface's turns along its two sides
    doubtful_out: wp.array(dtype=wp.uint8),
    rise_out: wp.array(dtype=float),
    turn_out: wp.array(dtype=float),
    # Out: 1 for doubtful cells, the same value from whoever writes
    cell_out: wp.array(dtype=wp.uint8),
):
    i = first + wp.tid()
    middle, normal = maps.planes[i].middle, maps.planes[i].normal
    number = maps.texel[i]
    axis = wp.where(number < maps.first_texel[1], 0, wp.where(number < maps.first_texel[2], 1, 2))
    columns = maps.size[(axis + 1) % 3]
    texel = wp.vec2i((number - maps.first_texel[axis]) % columns, (number - maps.first_texel[axis]) / columns)
    doubtful = bool(False)
    rise = float(0.0)
    squares = float(0.0)
    for side in range(2):
        way = wp.vec2i(1 - side, side)
        ahead = neighbour_onwards(maps, axis, texel, way, middle, normal, largest_turn)
        behind = neighbour_onwards(maps, axis, texel, -way, middle, normal, largest_turn)
        doubtful = doubtful or ahead.follows <= 0 or behind.follows <= 0
        # What is in another map lies elsewhere in it: the other side alone tells the turn.
        weight_ahead = wp.where(ahead.follows != 0 and ahead.is_beside, 1.0, 0.0)
        weight_behind = wp.where(behind.follows != 0 and behind.is_beside, 1.0, 0.0)
        weights = wp.max(weight_ahead + weight_behind, 1.0)
        turn = 2.0 * (weight_ahead * ahead.height + weight_behind * behind.height) / weights
        rise += RISE_PER_TURN * turn
        squares += turn * turn
    doubtful_out[i] = wp.where(doubtful, wp.uint8(1), wp.uint8(0))
    rise_out[i] = rise
    turn_out[i] = squares / (maps.cells_per_texel * maps.cells_per_texel)
    if doubtful:
        box = cells_of_patch(maps.cells, maps.patches[i])
        for z in range(box.first[2], box.last[2] + 1):
            for y in range(box.first[1], box.last[1] + 1):
                for x in range(box.first[0], box.last[0] + 1):
                    cell_out[number_of_cell(maps.cells, x, y, z)] = wp.uint8(1)


@kernel
def raise_patches(
    first: int,
    # In:
    planes: wp.array(dtype=PatchPlane),
    rise: wp.array(dtype=float),
    # In, out:
    patches: wp.array(dtype=Piece),
):
    i = first + wp.tid()
    patches[i].corner = patches[i].corner + rise[i] * planes[i].normal


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
    turn: wp.array
    """(n,) float32, the squares of the surface's turns over a patch, in radians, summed over its two axes; empty if not
    known."""
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
    unknown = wp.empty(0, dtype=float, device=patches.device)
    return Doubts(
        patches, unknown, 0.0, nothing, wp.zeros(nx * ny * nz, dtype=wp.uint8, device=patches.device), survey.cells
    )


def doubts_of(survey: Survey, largest_turn: float) -> Doubts:
    """Compare every patch with its neighbours; ``largest_turn`` in radians is when they are in doubt."""
    frame, (patches, texel) = survey.frame, survey.patches()
    device, count = patches.device, patches.shape[0]
    maps = PatchMap()
    maps.start, ranks = bin_items(texel, frame.first_texels[3], device)
    maps.patches, maps.texel = wp.empty_like(patches), wp.empty_like(texel)
    maps.planes = wp.empty(count, dtype=PatchPlane, device=device)
    launch(sort_patches, count, [patches, texel, maps.start, ranks, maps.patches, maps.planes, maps.texel], device)
    maps.size, maps.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
    maps.cells_per_texel, maps.cells = survey.cells_per_texel, survey.cells
    doubtful = wp.empty(count, dtype=wp.uint8, device=device)
    rise, turn = (wp.empty(count, dtype=float, device=device) for _ in range(2))
    cell_count = survey.cells[0] * survey.cells[1] * survey.cells[2]
    cells, near = (wp.zeros(cell_count, dtype=wp.uint8, device=device) for _ in range(2))
    launch(find_doubts, count, [maps, largest_turn, doubtful, rise, turn, cells], device)
    launch(raise_patches, count, [maps.planes, rise, maps.patches], device)
    doubts = int(np.count_nonzero(doubtful.numpy()))
    if doubts == 0:
        return Doubts(maps.patches, turn, 0.0, wp.empty(0, dtype=wp.uint8, device=device), near, survey.cells)
    launch(find_near, cell_count, [cells, survey.cells, near], device)
    return Doubts(maps.patches, turn, doubts / count, cells, near, survey.cells)
