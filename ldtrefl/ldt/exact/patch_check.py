"""Where patches do not follow the surface: there its triangles are kept.

A patch is the plane of one triangle over a texel. Where a surface is smooth at the scale of texels, neighbours in a map
go on into each other; where it turns out of what one map faces, another map goes on. Such patches are then moved to the
mean height of the surface over their texels. Where neighbours do not go on (the surface is rough, bent within a few
texels, ends, or has an edge), a patch may be off by a texel: it is *doubtful*, and so are the cells that it lies in. No
patch is used there, and every triangle is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.device.bins import CHUNK, bin_items, chunk_count, gather_lists, launch_chunks
from ldtrefl.device.launch import kernel, launch
from ldtrefl.geometry.box import cell_count, cell_number, cell_of_box, cells_about
from ldtrefl.ldt.exact.patch import Patch, cells_of_patch, crosses_cell, patch_middle, patch_normal
from ldtrefl.ldt.exact.survey import Survey
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

NONE, GOES_ON, TURNS_AWAY = wp.constant(0), wp.constant(1), wp.constant(-1)
"""What lies beside a patch: no patch, one that the surface goes on in, or one that is turned or offset."""


@wp.struct
class PatchPlane:
    """The plane of a patch, in cells."""

    middle: wp.vec3
    normal: wp.vec3  # unit


@wp.struct
class PatchMap:
    """Patches, texel by texel."""

    patches: wp.array(dtype=Patch)
    planes: wp.array(dtype=PatchPlane)
    texel: wp.array(dtype=wp.int32)  # of each patch
    start: wp.array(dtype=wp.int32)  # first patch of each texel, the three axes' maps in a row
    size: wp.vec3i  # texels
    first_texel: wp.vec3i
    cells_per_texel: float
    cells: wp.vec3i
    largest_turn: float  # radians between neighbours from which they are doubtful


@wp.struct
class Neighbour:
    """What a map holds beside a patch."""

    is_there: int  # NONE, GOES_ON or TURNS_AWAY
    height: float  # over the patch's plane, cells
    is_beside: bool  # it is there, in the same map


@wp.func
def nearest_in_texel(maps: PatchMap, plane: PatchPlane, ahead: wp.vec3, texel: int, off: float) -> Neighbour:
    """The patch of a texel that is nearest to a plane and faces the same way.

    It must lie ``ahead`` of the plane's middle, or anywhere if that is 0. It may lie ``off`` sides off the plane per
    radian.
    """
    nearest = REACH * maps.cells_per_texel
    allowed = off * maps.largest_turn * maps.cells_per_texel
    found = Neighbour()
    for k in range(maps.start[texel], maps.start[texel + 1]):
        other = maps.planes[k]
        apart = other.middle - plane.middle
        height = wp.dot(plane.normal, apart)
        cosine = wp.dot(plane.normal, other.normal)
        if wp.abs(height) < nearest and cosine > 0.0 and wp.dot(apart, ahead) >= AHEAD * wp.dot(ahead, ahead):
            nearest = wp.abs(height)
            fits = 1.0 - cosine * cosine <= maps.largest_turn * maps.largest_turn and nearest <= allowed
            found.is_there = wp.where(fits, GOES_ON, TURNS_AWAY)
            found.height = height
    found.is_beside = True
    return found


@wp.func
def neighbour_elsewhere(maps: PatchMap, axis: int, plane: PatchPlane, ahead: wp.vec3) -> Neighbour:
    """The patch that one of the other two maps holds near the point ``ahead`` of a plane's middle."""
    found = Neighbour()
    point = (plane.middle + ahead) / maps.cells_per_texel
    for k in range(1, 3):
        other = (axis + k) % 3
        columns, rows = maps.size[(other + 1) % 3], maps.size[(other + 2) % 3]
        # The four texels whose middles are nearest.
        first_u = int(wp.floor(point[(other + 1) % 3] - 0.5))
        first_v = int(wp.floor(point[(other + 2) % 3] - 0.5))
        for v in range(wp.max(first_v, 0), wp.min(first_v + 2, rows)):
            for u in range(wp.max(first_u, 0), wp.min(first_u + 2, columns)):
                if found.is_there != GOES_ON:
                    texel = maps.first_texel[other] + v * columns + u
                    there = nearest_in_texel(maps, plane, ahead, texel, OFF_ELSEWHERE)
                    if there.is_there != NONE:
                        found = there
    found.is_beside = False
    return found


@wp.func
def neighbour_towards(maps: PatchMap, axis: int, texel: wp.vec2i, step: wp.vec2i, plane: PatchPlane) -> Neighbour:
    """What goes on from a patch: the next texel of its own map if that holds a patch, else another map."""
    columns, rows = maps.size[(axis + 1) % 3], maps.size[(axis + 2) % 3]
    u, v = texel[0] + step[0], texel[1] + step[1]
    found = Neighbour()
    if u >= 0 and u < columns and v >= 0 and v < rows:
        beside = maps.first_texel[axis] + v * columns + u
        found = nearest_in_texel(maps, plane, wp.vec3(0.0), beside, OFF_BESIDE)
    if found.is_there == NONE:
        du, dv = float(step[0]), float(step[1])
        normal = plane.normal
        rise = -(du * normal[(axis + 1) % 3] + dv * normal[(axis + 2) % 3]) / normal[axis]
        ahead = maps.cells_per_texel * point_from_texel(axis, wp.vec3(du, dv, rise))
        found = neighbour_elsewhere(maps, axis, plane, ahead)
    return found


@kernel
def sort_patches(
    first: int,
    # In:
    patches: wp.array(dtype=Patch),
    texel: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    # Out:
    patches_out: wp.array(dtype=Patch),
    planes_out: wp.array(dtype=PatchPlane),
    texel_out: wp.array(dtype=wp.int32),
):
    """A thread puts one patch into its place in its texel."""
    i = first + wp.tid()
    place = start[texel[i]] + ranks[i]
    patch = patches[i]
    plane = PatchPlane()
    plane.middle = patch_middle(patch)
    plane.normal = patch_normal(patch)
    patches_out[place] = patch
    planes_out[place] = plane
    texel_out[place] = texel[i]


@kernel
def compare_with_neighbours(
    first: int,
    # In:
    maps: PatchMap,
    # Out, per patch: 1 for a doubtful one; the mean height of the surface over it, cells; the sum of the squares of the
    # surface's turns along its two sides, radians
    doubtful_out: wp.array(dtype=wp.uint8),
    rise_out: wp.array(dtype=float),
    turn_out: wp.array(dtype=float),
    # Out: 1 for doubtful cells, the same value from whoever writes
    cell_out: wp.array(dtype=wp.uint8),
):
    """A thread compares one patch with its four neighbours."""
    i = first + wp.tid()
    plane = maps.planes[i]
    number = maps.texel[i]
    axis = wp.where(number < maps.first_texel[1], 0, wp.where(number < maps.first_texel[2], 1, 2))
    columns = maps.size[(axis + 1) % 3]
    texel = wp.vec2i((number - maps.first_texel[axis]) % columns, (number - maps.first_texel[axis]) / columns)
    doubtful = bool(False)
    rise = float(0.0)
    squares = float(0.0)
    for side in range(2):
        step = wp.vec2i(1 - side, side)
        ahead = neighbour_towards(maps, axis, texel, step, plane)
        behind = neighbour_towards(maps, axis, texel, -step, plane)
        doubtful = doubtful or ahead.is_there != GOES_ON or behind.is_there != GOES_ON
        # A patch of another map lies elsewhere in its texel: the neighbour on the other side alone tells the turn.
        weight_ahead, weight_behind = wp.where(ahead.is_beside, 1.0, 0.0), wp.where(behind.is_beside, 1.0, 0.0)
        weights = wp.max(weight_ahead + weight_behind, 1.0)
        turn = 2.0 * (weight_ahead * ahead.height + weight_behind * behind.height) / weights
        rise += RISE_PER_TURN * turn
        squares += turn * turn
    doubtful_out[i] = wp.where(doubtful, wp.uint8(1), wp.uint8(0))
    rise_out[i] = rise
    turn_out[i] = squares / (maps.cells_per_texel * maps.cells_per_texel)
    if doubtful:
        box = cells_of_patch(maps.patches[i], maps.cells)
        for k in range(cell_count(box)):
            cell_out[cell_number(cell_of_box(box, k), maps.cells)] = wp.uint8(1)


@kernel
def raise_patches(
    first: int,
    # In:
    planes: wp.array(dtype=PatchPlane),
    rise: wp.array(dtype=float),
    # In, out:
    patches: wp.array(dtype=Patch),
):
    """A thread moves one patch to the mean height of the surface over it."""
    i = first + wp.tid()
    patches[i].corner = patches[i].corner + rise[i] * planes[i].normal


@kernel
def mark_near(
    first: int,
    # In:
    doubtful: wp.array(dtype=wp.uint8),
    cells: wp.vec3i,
    # Out: 1 for doubtful cells and those beside them, the same value from whoever writes
    near_out: wp.array(dtype=wp.uint8),
):
    """A thread marks the cells about one cell, if that is doubtful."""
    i = first + wp.tid()
    if doubtful[i] == wp.uint8(0):
        return
    box = cells_about(wp.vec3i(i % cells[0], (i / cells[0]) % cells[1], i / (cells[0] * cells[1])), cells)
    for k in range(cell_count(box)):
        near_out[cell_number(cell_of_box(box, k), cells)] = wp.uint8(1)


@wp.func
def lies_in_doubtful_cell(patch: Patch, doubtful: wp.array(dtype=wp.uint8), cells: wp.vec3i) -> bool:
    """Whether any of the cells in the box about a patch is doubtful; none is if the array is empty."""
    found = bool(False)
    if doubtful.shape[0] > 0:
        box = cells_of_patch(patch, cells)
        for k in range(cell_count(box)):
            if doubtful[cell_number(cell_of_box(box, k), cells)] != wp.uint8(0):
                found = True
    return found


@wp.func
def mark_touched(patch: Patch, cells: wp.vec3i, touched_out: wp.array(dtype=wp.uint8)):
    """Mark the cells that a patch crosses."""
    box = cells_of_patch(patch, cells)
    for k in range(cell_count(box)):
        cell = cell_of_box(box, k)
        if crosses_cell(patch, cell):
            touched_out[cell_number(cell, cells)] = wp.uint8(1)


@kernel
def list_reliable(
    first: int,
    # In:
    patches: wp.array(dtype=Patch),
    doubtful: wp.array(dtype=wp.uint8),  # cells; empty: none is
    cells: wp.vec3i,
    # Out, per chunk: patches outside doubtful cells, and their list as records; 1 for cells with one of them, the same
    # value from whoever writes
    count_out: wp.array(dtype=wp.int32),
    list_out: wp.array(dtype=wp.int32),
    touched_out: wp.array(dtype=wp.uint8),
):
    """A thread lists the reliable ones of one chunk of patches."""
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    count = int(0)
    for i in range(begin, wp.min(begin + CHUNK, patches.shape[0])):
        if not lies_in_doubtful_cell(patches[i], doubtful, cells):
            list_out[begin + count] = -1 - i
            count += 1
            mark_touched(patches[i], cells, touched_out)
    count_out[chunk] = count


@dataclass(frozen=True, eq=False)
class CheckedPatches:
    """Patches, and which of them are doubtful."""

    patches: wp.array
    """(n,) ``Patch``."""
    turn: wp.array
    """(n,) float32, the squares of the surface's turns over a patch, in radians, summed over its two axes; empty if not
    known."""
    doubtful_share: float
    """Of all patches, those that are doubtful themselves."""
    doubtful_cells: wp.array
    """(cells,) uint8, 1 for doubtful cells of the survey; empty if none is."""
    near_doubtful: wp.array
    """(cells,) uint8, 1 for those and the cells beside them."""
    cells: wp.vec3i
    """Cells of the survey along x, y and z."""

    def reliable(self) -> tuple[wp.array, wp.array]:
        """The patches outside doubtful cells.

        Returns:
            records: (m,) int32, -1 for patch 0.
            touched: (cells,) uint8, 1 for cells that one of them crosses.
        """
        device, count = self.patches.device, self.patches.shape[0]
        counts = wp.zeros(chunk_count(count) + 1, dtype=wp.int32, device=device)
        listed, touched = wp.empty(count, dtype=wp.int32, device=device), wp.zeros_like(self.near_doubtful)
        inputs = [self.patches, self.doubtful_cells, self.cells, counts, listed, touched]
        launch_chunks(list_reliable, count, inputs, device)
        return gather_lists(listed, counts), touched


def unchecked(survey: Survey) -> CheckedPatches:
    """The patches of a survey, all of them taken for reliable."""
    patches, _ = survey.patches()
    nx, ny, nz = survey.cells
    near = wp.zeros(nx * ny * nz, dtype=wp.uint8, device=patches.device)
    none = wp.empty(0, dtype=wp.uint8, device=patches.device)
    unknown = wp.empty(0, dtype=float, device=patches.device)
    return CheckedPatches(patches, unknown, 0.0, none, near, survey.cells)


def checked(survey: Survey, largest_turn: float) -> CheckedPatches:
    """The patches of a survey, compared with their neighbours; ``largest_turn`` in radians makes them doubtful."""
    maps = _patch_map(survey, largest_turn)
    device, count = maps.patches.device, maps.patches.shape[0]
    doubtful = wp.empty(count, dtype=wp.uint8, device=device)
    rise, turn = (wp.empty(count, dtype=float, device=device) for _ in range(2))
    total = survey.cells[0] * survey.cells[1] * survey.cells[2]
    cells, near = (wp.zeros(total, dtype=wp.uint8, device=device) for _ in range(2))
    launch(compare_with_neighbours, count, [maps, doubtful, rise, turn, cells], device)
    launch(raise_patches, count, [maps.planes, rise, maps.patches], device)
    share = int(np.count_nonzero(doubtful.numpy())) / count
    if share == 0.0:
        cells = wp.empty(0, dtype=wp.uint8, device=device)
    else:
        launch(mark_near, total, [cells, survey.cells, near], device)
    return CheckedPatches(maps.patches, turn, share, cells, near, survey.cells)


def _patch_map(survey: Survey, largest_turn: float) -> PatchMap:
    """The patches of a survey, sorted by texel."""
    frame, (patches, texel) = survey.frame, survey.patches()
    device, count = patches.device, patches.shape[0]
    maps = PatchMap()
    maps.start, ranks = bin_items(texel, frame.first_texels[3], device)
    maps.patches, maps.texel = wp.empty_like(patches), wp.empty_like(texel)
    maps.planes = wp.empty(count, dtype=PatchPlane, device=device)
    launch(sort_patches, count, [patches, texel, maps.start, ranks, maps.patches, maps.planes, maps.texel], device)
    maps.size, maps.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
    maps.cells_per_texel, maps.cells, maps.largest_turn = survey.cells_per_texel, survey.cells, largest_turn
    return maps
