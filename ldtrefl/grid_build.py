"""Mesh -> occupancy grid (``grid.py``): make the records, find the cells they touch, lay out what is occupied.

patches, or triangles -> (cell, record) pairs -> sort by cell -> bricks, masks, leaps -> blocks of records
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.binning import bin_items, exclusive_scan, list_items
from ldtrefl.cubemap import TexelFrame, point_from_texel, texel_frame
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.grid import BRICK, CELLS, LANES, LARGE_PATCH, ROWS, SMALL_PATCH, TRIANGLE, Grid, GridView
from ldtrefl.peel import Fragments, Rasteriser

Quality = Literal["fast", "balanced", "exact"]

GRID_CELLS = 48
"""Cells along the longest side of an ordinary grid. Of 32, 48, 64 and 96 the fastest, within 3%, on the median of the
real test meshes; 32 is faster on the smallest, 64 on the largest."""
FAST_GRID_CELLS = 32
"""The same for the large patches of a fast grid."""
DENSE_GRID_CELLS = 128
"""The same where every triangle of a dense mesh is kept."""

PATCH_TEXELS: dict[Quality, float] = {"fast": 4.0, "balanced": 1.6}
"""Texels along a side of a patch. The plane of one is off by the square of its side: on a torus knot at 256, 1.6 texels
give 0.15% wrong hits and a tenth of a texel at the 99th percentile; 1 texel a third of that at 15% more time."""

DENSE = 1.5
"""Triangles per texel of surface from which patches stand for triangles: the maps are then the coarser picture."""
DENSE_TRIANGLES = 300_000
"""Triangles from which a grid that keeps them all has more cells."""

FACING = wp.constant(0.55)
"""|n . axis| from which a map keeps a fragment as a patch: every direction faces one of the three with 0.577 or more.
At 0.577 itself, where two maps meet on a bent surface, twice as many rays slipped between their patches."""
PATCH_MARGIN = wp.constant(0.06)
"""Part of a patch's side added around it, so that neighbours on a bent surface overlap instead of leaving a slit. With
0.02 one ray in a thousand slipped through to the far wall, specks in the picture; with 0.06 none did, at a fifth more
wrong hits along silhouettes."""
LARGE = wp.constant(2.0)
"""Patches across from which a triangle of a dense mesh is kept as it is."""

CELL_MARGIN = wp.constant(1.0e-3)
"""Cells by which cells are widened when records are put into them, for the rounding of rays."""
LARGEST_LEAP = wp.constant(250)
"""Bricks: what fits in a byte, and more than a grid has."""


@wp.struct
class CellBox:
    """The cells that a record may touch."""

    first: wp.vec3i
    last: wp.vec3i


@wp.struct
class Piece:
    """A record's shape: corner, and the two edges from it; a triangle, or a parallelogram."""

    corner: wp.vec3
    edge_u: wp.vec3
    edge_v: wp.vec3
    kind: float  # TRIANGLE, or a patch: a parallelogram; 0 for no piece


@wp.struct
class GridTarget:
    """What records are made from, and the cells that they go into."""

    vertices: wp.array(dtype=wp.vec3)  # unit space
    faces: wp.array(dtype=wp.vec3i)
    texel: wp.array(dtype=wp.int32)  # fragments, raw
    depth: wp.array(dtype=wp.float32)
    reference: wp.array(dtype=wp.int32)
    patches: wp.array(dtype=Piece)  # of the fragments
    size: wp.vec3i  # of the maps, texels
    first_texel: wp.vec3i
    cells_per_texel: float
    cells_per_unit: float
    cell_offset: wp.vec3
    bricks: wp.vec3i


@wp.func
def triangle_piece(target: GridTarget, triangle: int) -> Piece:
    """A triangle in cell space."""
    corners = target.faces[triangle]
    a = target.cells_per_unit * target.vertices[corners[0]] + target.cell_offset
    b = target.cells_per_unit * target.vertices[corners[1]] + target.cell_offset
    c = target.cells_per_unit * target.vertices[corners[2]] + target.cell_offset
    piece = Piece()
    piece.corner = a
    piece.edge_u = b - a
    piece.edge_v = c - a
    piece.kind = TRIANGLE
    return piece


@wp.func
def patch_piece(target: GridTarget, fragment: int) -> Piece:
    """A fragment's texel lifted to its triangle's plane, in cell space; none where the map does not face it."""
    number = target.texel[fragment]
    axis = int(0)
    if number >= target.first_texel[1]:
        axis = 1
    if number >= target.first_texel[2]:
        axis = 2
    piece = Piece()
    corners = target.faces[target.reference[fragment] >> 1]
    a, b, c = target.vertices[corners[0]], target.vertices[corners[1]], target.vertices[corners[2]]
    normal = wp.normalize(wp.cross(b - a, c - a))
    if wp.abs(normal[axis]) < FACING:
        return piece
    within = number - target.first_texel[axis]
    columns = target.size[(axis + 1) % 3]
    u, v = float(within % columns), float(within / columns)
    slope_u, slope_v = -normal[(axis + 1) % 3] / normal[axis], -normal[(axis + 2) % 3] / normal[axis]
    half, side = 0.5 + PATCH_MARGIN, 1.0 + 2.0 * PATCH_MARGIN
    depth = target.depth[fragment] - half * (slope_u + slope_v)
    scale = target.cells_per_texel
    piece.corner = scale * point_from_texel(axis, wp.vec3(u - PATCH_MARGIN, v - PATCH_MARGIN, depth))
    piece.edge_u = scale * side * point_from_texel(axis, wp.vec3(1.0, 0.0, slope_u))
    piece.edge_v = scale * side * point_from_texel(axis, wp.vec3(0.0, 1.0, slope_v))
    if normal[axis] < 0.0:
        # The record's normal is the triangle's.
        along_u = scale * side * point_from_texel(axis, wp.vec3(0.0, 1.0, slope_v))
        piece.edge_v = scale * side * point_from_texel(axis, wp.vec3(1.0, 0.0, slope_u))
        piece.edge_u = along_u
    piece.kind = SMALL_PATCH
    extent = wp.max(wp.max(a, wp.max(b, c)) - wp.min(a, wp.min(b, c)))
    if target.cells_per_unit * extent > scale:
        piece.kind = LARGE_PATCH
    return piece


@launch.kernel
def make_patches(
    first: int,
    # In:
    target: GridTarget,
    # Out:
    patches_out: wp.array(dtype=Piece),
):
    i = first + wp.tid()
    patches_out[i] = patch_piece(target, i)


@wp.func
def piece_of(target: GridTarget, item: int) -> Piece:
    """Items from 0 are triangles, below 0 fragments: -1 is fragment 0."""
    if item >= 0:
        return triangle_piece(target, item)
    return target.patches[-1 - item]


@wp.func
def cell_number(x: float, cells: int) -> int:
    """The cell that holds a coordinate; the nearest if none does."""
    return wp.clamp(int(wp.floor(x)), 0, cells - 1)


@wp.func
def cells_touched(target: GridTarget, piece: Piece) -> CellBox:
    """The cells of the box about a piece."""
    b, c = piece.corner + piece.edge_u, piece.corner + piece.edge_v
    low = wp.min(piece.corner, wp.min(b, c))
    high = wp.max(piece.corner, wp.max(b, c))
    if piece.kind > TRIANGLE:
        d = b + piece.edge_v
        low = wp.min(low, d)
        high = wp.max(high, d)
    nx, ny, nz = BRICK * target.bricks[0], BRICK * target.bricks[1], BRICK * target.bricks[2]
    m = CELL_MARGIN
    box = CellBox()
    box.first = wp.vec3i(cell_number(low[0] - m, nx), cell_number(low[1] - m, ny), cell_number(low[2] - m, nz))
    box.last = wp.vec3i(cell_number(high[0] + m, nx), cell_number(high[1] + m, ny), cell_number(high[2] + m, nz))
    return box


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
def brick_major(bricks: wp.vec3i, x: int, y: int, z: int) -> int:
    """Number of a cell: bricks in a row, 64 cells each."""
    brick = ((z / BRICK) * bricks[1] + y / BRICK) * bricks[0] + x / BRICK
    return CELLS * brick + ((z % BRICK) * BRICK + y % BRICK) * BRICK + x % BRICK


@launch.kernel
def find_cells(
    first: int,
    # In:
    target: GridTarget,
    items: wp.array(dtype=wp.int32),
    first_item: int,
    step: int,
    places: wp.array(dtype=wp.int32),
    is_counting: int,
    # Out:
    counts_out: wp.array(dtype=wp.int32),
    cell_out: wp.array(dtype=wp.int32),
    item_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    item = first_item + step * i
    if items.shape[0] > 0:
        item = items[i]
    place = int(0)
    end = int(0)
    if is_counting == 0:
        place = places[i]
        end = places[i + 1]
        if place == end:
            return
    piece = piece_of(target, item)
    count = int(0)
    if piece.kind > 0.0:
        box = cells_touched(target, piece)
        if box.first == box.last:
            count = 1
            if is_counting == 0:
                cell_out[place] = brick_major(target.bricks, box.first[0], box.first[1], box.first[2])
                item_out[place] = item
        else:
            for z in range(box.first[2], box.last[2] + 1):
                for y in range(box.first[1], box.last[1] + 1):
                    for x in range(box.first[0], box.last[0] + 1):
                        if touches_cell(piece, x, y, z):
                            if is_counting == 0:
                                cell_out[place + count] = brick_major(target.bricks, x, y, z)
                                item_out[place + count] = item
                            count += 1
    if is_counting != 0:
        counts_out[i] = count


@launch.kernel
def mark_cells(
    first: int,
    # In:
    cell: wp.array(dtype=wp.int32),
    # Out: the same value from whoever writes
    marked_out: wp.array(dtype=wp.uint8),
):
    i = first + wp.tid()
    marked_out[cell[i]] = wp.uint8(1)


@launch.kernel
def find_needed_triangles(
    first: int,
    # In:
    target: GridTarget,
    marked: wp.array(dtype=wp.uint8),
    # Out: 1 where patches do not stand for the triangle
    needed_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    corners = target.faces[i]
    a = target.cells_per_unit * target.vertices[corners[0]] + target.cell_offset
    b = target.cells_per_unit * target.vertices[corners[1]] + target.cell_offset
    c = target.cells_per_unit * target.vertices[corners[2]] + target.cell_offset
    extent = wp.max(wp.max(a, wp.max(b, c)) - wp.min(a, wp.min(b, c)))
    middle = (a + b + c) / 3.0
    x = cell_number(middle[0], BRICK * target.bricks[0])
    y = cell_number(middle[1], BRICK * target.bricks[1])
    z = cell_number(middle[2], BRICK * target.bricks[2])
    is_lost = marked[brick_major(target.bricks, x, y, z)] == wp.uint8(0)
    needed_out[i] = int(is_lost or extent > LARGE * target.cells_per_texel)


@launch.kernel
def find_occupied_bricks(
    first: int,
    # In:
    start: wp.array(dtype=wp.int32),
    # Out:
    occupied_out: wp.array(dtype=wp.int32),
    blocks_out: wp.array(dtype=wp.int32),
):
    brick = first + wp.tid()
    blocks = int(0)
    for cell in range(CELLS * brick, CELLS * brick + CELLS):
        blocks += (start[cell + 1] - start[cell] + LANES - 1) / LANES
    occupied_out[brick] = wp.where(blocks > 0, 1, 0)
    blocks_out[brick] = blocks


@launch.kernel
def lay_out_bricks(
    first: int,
    # In:
    start: wp.array(dtype=wp.int32),
    number: wp.array(dtype=wp.int32),
    first_block: wp.array(dtype=wp.int32),
    # Out:
    brick_out: wp.array(dtype=wp.int32),
    mask_out: wp.array(dtype=wp.uint64),
    block_out: wp.array(dtype=wp.int32),
):
    brick = first + wp.tid()
    if number[brick] == number[brick + 1]:
        brick_out[brick] = -1
        return
    occupied = number[brick]
    brick_out[brick] = occupied
    mask = wp.uint64(0)
    block = int(first_block[brick])
    for k in range(CELLS):
        block_out[CELLS * occupied + k] = block
        records = start[CELLS * brick + k + 1] - start[CELLS * brick + k]
        if records > 0:
            mask = mask | (wp.uint64(1) << wp.uint64(k))
            block += (records + LANES - 1) / LANES
    block_out[CELLS * occupied + CELLS] = block
    mask_out[occupied] = mask


@launch.kernel
def find_leaps(
    first: int,
    # In:
    brick: wp.array(dtype=wp.int32),
    bricks: wp.vec3i,
    # Out:
    leaps_out: wp.array(dtype=wp.uint8),
):
    # The largest empty cube of bricks that starts at a brick and grows along the octant is one larger than the
    # smallest of its seven neighbours' that way; beyond the grid all is empty.
    octant = first + wp.tid()
    nx, ny, nz = bricks[0], bricks[1], bricks[2]
    base = octant * nx * ny * nz
    dx = wp.where(octant % 2 == 1, 1, -1)
    dy = wp.where((octant / 2) % 2 == 1, nx, -nx)
    dz = wp.where(octant / 4 == 1, nx * ny, -nx * ny)
    for step_z in range(nz):
        z = wp.where(dz > 0, nz - 1 - step_z, step_z)
        for step_y in range(ny):
            y = wp.where(dy > 0, ny - 1 - step_y, step_y)
            for step_x in range(nx):
                x = wp.where(dx > 0, nx - 1 - step_x, step_x)
                i = (z * ny + y) * nx + x
                leap = int(0)
                if brick[i] < 0:
                    smallest = int(LARGEST_LEAP - 1)
                    if step_x > 0:
                        smallest = wp.min(smallest, int(leaps_out[base + i + dx]))
                    if step_y > 0:
                        smallest = wp.min(smallest, int(leaps_out[base + i + dy]))
                        if step_x > 0:
                            smallest = wp.min(smallest, int(leaps_out[base + i + dx + dy]))
                    if step_z > 0:
                        smallest = wp.min(smallest, int(leaps_out[base + i + dz]))
                        if step_x > 0:
                            smallest = wp.min(smallest, int(leaps_out[base + i + dx + dz]))
                        if step_y > 0:
                            smallest = wp.min(smallest, int(leaps_out[base + i + dy + dz]))
                            if step_x > 0:
                                smallest = wp.min(smallest, int(leaps_out[base + i + dx + dy + dz]))
                    leap = smallest + 1
                leaps_out[base + i] = wp.uint8(leap)


@launch.kernel
def fill_records(
    first: int,
    # In:
    target: GridTarget,
    cell: wp.array(dtype=wp.int32),
    item: wp.array(dtype=wp.int32),
    places: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    number: wp.array(dtype=wp.int32),
    block: wp.array(dtype=wp.int32),
    # Out:
    rows_out: wp.array(dtype=wp.float32),
    triangle_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    brick = cell[i] / CELLS
    rank = places[i] - start[cell[i]]
    at = block[CELLS * number[brick] + cell[i] % CELLS] + rank / LANES
    lane = rank % LANES
    if item[i] >= 0:
        triangle_out[LANES * at + lane] = item[i]
    else:
        triangle_out[LANES * at + lane] = target.reference[-1 - item[i]] >> 1
    x, y = brick % target.bricks[0], (brick / target.bricks[0]) % target.bricks[1]
    z = brick / (target.bricks[0] * target.bricks[1])
    piece = piece_of(target, item[i])
    corner = piece.corner - float(BRICK) * wp.vec3(float(x), float(y), float(z))
    normal = wp.cross(piece.edge_u, piece.edge_v)
    square = wp.dot(normal, normal)
    if square > 0.0:
        unit = normal / wp.sqrt(square)
        along_u = wp.cross(piece.edge_v, normal) / square
        along_v = wp.cross(normal, piece.edge_u) / square
        row = LANES * ROWS * at + lane
        for k in range(3):
            rows_out[row + k * LANES] = unit[k]
            rows_out[row + (4 + k) * LANES] = along_u[k]
            rows_out[row + (8 + k) * LANES] = along_v[k]
        rows_out[row + 3 * LANES] = wp.dot(unit, corner)
        rows_out[row + 7 * LANES] = -wp.dot(along_u, corner)
        rows_out[row + 11 * LANES] = -wp.dot(along_v, corner)
        rows_out[row + 12 * LANES] = piece.kind


def build_grid(geometry: DeviceMesh, resolution: int, quality: Quality) -> Grid:
    """The occupancy grid of a mesh; ``quality`` chooses between triangles and patches.

    ``exact`` keeps every triangle; the others keep them unless they are much finer than patches of ``PATCH_TEXELS`` of
    the maps' texels, which then stand for them.
    """
    triangles = len(geometry.faces)
    if quality != "exact":
        frame = texel_frame(geometry.mesh, max(1, round(resolution / PATCH_TEXELS[quality])))
        rasteriser = Rasteriser(geometry, frame)
        if triangles > DENSE * rasteriser.count * PATCH_TEXELS[quality] ** 2:
            raw = rasteriser.fragments()
            target = _target(geometry, frame, raw, FAST_GRID_CELLS if quality == "fast" else GRID_CELLS)
            cell, item = _patches_and_the_rest(target, raw, triangles)
            return Grid(_built(target, geometry, cell, item), cell.shape[0], True)
    cells = DENSE_GRID_CELLS if triangles > DENSE_TRIANGLES else GRID_CELLS
    target = _target(geometry, texel_frame(geometry.mesh, resolution), None, cells)
    cell, item = _cells_of(target, None, triangles, 0, 1, geometry.vertices.device)
    return Grid(_built(target, geometry, cell, item), cell.shape[0], False)


def _target(geometry: DeviceMesh, frame: TexelFrame, raw: Fragments | None, cells: int) -> Any:
    target = GridTarget()
    target.vertices, target.faces = geometry.vertices, geometry.faces
    if raw is not None:
        target.texel, target.depth, target.reference = raw.texel, raw.depth, raw.reference
    target.size, target.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
    ratio = cells / max(frame.size)
    target.cells_per_texel = ratio
    target.cells_per_unit = ratio * frame.scale
    target.cell_offset = wp.vec3(*(ratio * np.array(frame.offset)))
    x, y, z = (max(1, int(np.ceil(side * ratio / int(BRICK) - 1e-6))) for side in frame.size)
    target.bricks = wp.vec3i(x, y, z)
    if raw is not None:
        # Once, and not for every pass: a dense mesh's triangles are far apart in memory.
        fragments, device = raw.texel.shape[0], raw.texel.device
        patches = wp.empty(fragments, dtype=Piece, device=device)
        launch.launch(make_patches, fragments, [target, patches], device)
        target.patches = patches
    return target


def _cells_of(
    target: Any, items: wp.array | None, count: int, first_item: int, step: int, device: wp.Device
) -> tuple[wp.array, wp.array]:
    """(cell, item) of every pair that touches; items listed, or else ``first_item + step * i``."""
    listed = wp.empty(0, dtype=wp.int32, device=device) if items is None else items
    counts = wp.zeros(count + 1, dtype=wp.int32, device=device)
    nothing = wp.empty(0, dtype=wp.int32, device=device)
    launch.launch(find_cells, count, [target, listed, first_item, step, nothing, 1, counts, nothing, nothing], device)
    places, total = exclusive_scan(counts)
    cell, item = (wp.empty(total, dtype=wp.int32, device=device) for _ in range(2))
    launch.launch(find_cells, count, [target, listed, first_item, step, places, 0, nothing, cell, item], device)
    return cell, item


def _patches_and_the_rest(target: Any, raw: Fragments, triangles: int) -> tuple[wp.array, wp.array]:
    """(cell, item) of all patches, and of the triangles that no patch stands for: large ones, and those in cells that
    no patch touches, such as wires between texel centres."""
    device = raw.texel.device
    cell, item = _cells_of(target, None, raw.texel.shape[0], -1, -1, device)
    bricks = target.bricks[0] * target.bricks[1] * target.bricks[2]
    marked = wp.zeros(bricks * int(CELLS), dtype=wp.uint8, device=device)
    launch.launch(mark_cells, cell.shape[0], [cell, marked], device)
    needed = wp.zeros(triangles + 1, dtype=wp.int32, device=device)
    launch.launch(find_needed_triangles, triangles, [target, marked, needed], device)
    listed = list_items(needed)
    if listed.shape[0] == 0:
        return cell, item
    more_cells, more_items = _cells_of(target, listed, listed.shape[0], 0, 0, device)
    return tuple(_joined(a, b) for a, b in ((cell, more_cells), (item, more_items)))  # type: ignore[return-value]


def _joined(a: wp.array, b: wp.array) -> wp.array:
    both = wp.empty(a.shape[0] + b.shape[0], dtype=a.dtype, device=a.device)
    wp.copy(both, a)
    wp.copy(both, b, dest_offset=a.shape[0])
    return both


def _built(target: Any, geometry: DeviceMesh, cell: wp.array, item: wp.array) -> Any:
    device = cell.device
    bricks = target.bricks[0] * target.bricks[1] * target.bricks[2]
    start, places = bin_items(cell, bricks * int(CELLS), device)
    occupied, blocks = (wp.zeros(bricks + 1, dtype=wp.int32, device=device) for _ in range(2))
    launch.launch(find_occupied_bricks, bricks, [start, occupied, blocks], device)
    number, occupied_count = exclusive_scan(occupied)
    first_block, block_count = exclusive_scan(blocks)
    view = GridView()
    view.brick = wp.empty(bricks, dtype=wp.int32, device=device)
    view.mask = wp.empty(max(occupied_count, 1), dtype=wp.uint64, device=device)
    view.block = wp.zeros(occupied_count * int(CELLS) + 1, dtype=wp.int32, device=device)
    inputs = [start, number, first_block, view.brick, view.mask, view.block]
    launch.launch(lay_out_bricks, bricks, inputs, device)
    view.leaps = wp.empty(8 * bricks, dtype=wp.uint8, device=device)
    launch.launch(find_leaps, 8, [view.brick, target.bricks, view.leaps], device)
    view.rows = wp.zeros(block_count * int(LANES) * int(ROWS), dtype=wp.float32, device=device)
    view.triangle = wp.empty(block_count * int(LANES), dtype=wp.int32, device=device)
    inputs = [target, cell, item, places, start, number, view.block, view.rows, view.triangle]
    launch.launch(fill_records, cell.shape[0], inputs, device)
    centre, half = geometry.mesh.unit_frame
    low, high = ((bound - centre) / half * target.cells_per_unit + target.cell_offset for bound in geometry.mesh.bounds)
    view.low, view.high = wp.vec3(*low), wp.vec3(*high)
    view.bricks, view.vertices, view.faces = target.bricks, geometry.vertices, geometry.faces
    view.cells_per_unit, view.cell_offset = target.cells_per_unit, target.cell_offset
    return view
