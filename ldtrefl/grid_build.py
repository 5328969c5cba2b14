"""Mesh -> occupancy grid (``grid.py``): make the records, find the cells they touch, lay out what is occupied.

patches, or triangles -> (cell, record) pairs -> sort by cell -> bricks, masks, leaps -> blocks of records
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.binning import bin_items, exclusive_scan
from ldtrefl.cubemap import TexelFrame, texel_frame
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.doubts import Doubts, doubts_of, no_doubts
from ldtrefl.grid import BRICK, CELLS, LANES, ROWS, TRIANGLE, Grid, GridView, cell_number, number_of_cell
from ldtrefl.patches import Piece, Survey

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
give 0.1% wrong hits and a tenth of a texel at the 99th percentile; 1 texel a third of that at 15% more time."""

LARGEST_TURN: dict[Quality, float] = {"fast": 0.5, "balanced": 0.2}
"""Radians between neighbouring patches from which they are in doubt, see ``doubts.py``."""
DOUBTFUL = 0.05
"""Share of patches in doubt up to which the others are worth having; a detailed scan is better kept as triangles, in a
grid as fine as they are."""

DENSE = 2.2
"""Small triangles per texel of surface from which patches stand for them: the maps are then the coarser picture."""
FEW_TRIANGLES = 50_000
"""Triangles up to which all are kept, however fine: they fit in the cache, and a thin object stays exact."""
FEWEST_TRIANGLES = 2_000
"""The same in maps that are trusted: fewer take no more room than patches."""
CELLS_PER_TEXEL = 0.3
"""Cells in a texel of the patches, as ``GRID_CELLS`` has at the default resolution: coarser maps need no more."""
DENSE_TRIANGLES = 300_000
"""Triangles from which a grid that keeps them all has more cells."""

CELL_MARGIN = wp.constant(1.0e-3)
"""Cells by which cells are widened when records are put into them, for the rounding of rays."""
PATCH_RISE = wp.vec3(0.1)
"""Cells, a third of a patch, by which the box is widened for patches that rise out of it where the surface bends.
Without it one ray in ten thousand slipped under them to the far wall."""
ROUNDING = wp.constant(1.5e-7)
"""Of a ray's coordinates in cells, relative to the grid's size: two roundings of a float32."""
THINNEST = wp.constant(6.0e-7)
"""Height, in unit space, below which a triangle has no area: it is ten roundings of its corners, its normal chance."""
MASK_BITS = wp.constant(64)
"""Cells of an item's box up to which it is kept which of them it touches: that is the dearest thing to find out."""
LARGEST_LEAP = wp.constant(250)
"""Bricks: what fits in a byte, and more than a grid has."""


@wp.struct
class CellBox:
    """The cells that a record may touch."""

    first: wp.vec3i
    last: wp.vec3i


@wp.struct
class GridTarget:
    """What records are made from, and the cells that they go into."""

    vertices: wp.array(dtype=wp.vec3)  # unit space
    faces: wp.array(dtype=wp.vec3i)
    patches: wp.array(dtype=Piece)
    doubtful: wp.array(dtype=wp.uint8)  # 1 for cells that no patch goes into; empty: none
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
    piece.triangle = triangle
    return piece


@wp.func
def piece_of(target: GridTarget, item: int) -> Piece:
    """Items from 0 are triangles, below 0 patches: -1 is patch 0."""
    if item >= 0:
        return triangle_piece(target, item)
    return target.patches[-1 - item]


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
def item_number(target: GridTarget, items: wp.array(dtype=wp.int32), i: int) -> int:
    """The ``i``-th item: of those listed; else of all patches; else of all triangles."""
    if items.shape[0] > 0:
        return items[i]
    return wp.where(target.patches.shape[0] > 0, -1 - i, i)


@wp.func
def fits_mask(box: CellBox) -> bool:
    """Whether a box has no more cells than a mask has bits."""
    n = box.last - box.first + wp.vec3i(1)
    return wp.int64(n[0]) * wp.int64(n[1]) * wp.int64(n[2]) <= wp.int64(MASK_BITS)


@wp.func
def belongs(target: GridTarget, piece: Piece, x: int, y: int, z: int) -> bool:
    """Whether a piece may go into a cell."""
    if piece.kind == TRIANGLE or target.doubtful.shape[0] == 0:
        return True
    return target.doubtful[number_of_cell(target.bricks, x, y, z)] == wp.uint8(0)


@launch.kernel
def find_cells(
    first: int,
    # In:
    target: GridTarget,
    items: wp.array(dtype=wp.int32),
    # Out:
    counts_out: wp.array(dtype=wp.int32),
    masks_out: wp.array(dtype=wp.uint64),  # bit k: the item touches cell k of its box; of small boxes only
):
    i = first + wp.tid()
    piece = piece_of(target, item_number(target, items, i))
    box = cells_touched(target, piece)
    is_one_cell = box.first == box.last
    is_masked = fits_mask(box)
    count = int(0)
    mask = wp.uint64(0)
    bit = wp.uint64(1)
    for z in range(box.first[2], box.last[2] + 1):
        for y in range(box.first[1], box.last[1] + 1):
            for x in range(box.first[0], box.last[0] + 1):
                if belongs(target, piece, x, y, z) and (is_one_cell or touches_cell(piece, x, y, z)):
                    count += 1
                    if is_masked:
                        mask = mask | bit
                bit = bit << wp.uint64(1)
    counts_out[i] = count
    masks_out[i] = mask


@launch.kernel
def list_cells(
    first: int,
    # In:
    target: GridTarget,
    items: wp.array(dtype=wp.int32),
    masks: wp.array(dtype=wp.uint64),
    places: wp.array(dtype=wp.int32),
    # Out:
    cell_out: wp.array(dtype=wp.int32),
    item_out: wp.array(dtype=wp.int32),
    touched_out: wp.array(dtype=wp.uint8),  # 1 for cells with a pair: the same value from whoever writes
):
    i = first + wp.tid()
    place = int(places[i])
    if place == places[i + 1]:
        return
    item = item_number(target, items, i)
    piece = piece_of(target, item)
    box = cells_touched(target, piece)
    is_masked = fits_mask(box)
    mask = masks[i]
    for z in range(box.first[2], box.last[2] + 1):
        for y in range(box.first[1], box.last[1] + 1):
            for x in range(box.first[0], box.last[0] + 1):
                is_touched = (mask & wp.uint64(1)) != wp.uint64(0)
                if not is_masked:
                    is_touched = belongs(target, piece, x, y, z) and touches_cell(piece, x, y, z)
                if is_touched:
                    cell = number_of_cell(target.bricks, x, y, z)
                    cell_out[place] = cell
                    item_out[place] = item
                    touched_out[cell] = wp.uint8(1)
                    place += 1
                mask = mask >> wp.uint64(1)


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
    rows_out: wp.array(dtype=wp.float32),  # a cell's last block cleared: it may be filled in part
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
            for i in range(LANES * ROWS * (block - 1), LANES * ROWS * block):
                rows_out[i] = 0.0
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


@wp.func
def as_double(p: wp.vec3) -> wp.vec3d:
    """The same vector in float64."""
    return wp.vec3d(wp.float64(p[0]), wp.float64(p[1]), wp.float64(p[2]))


@wp.func
def as_single(p: wp.vec3d) -> wp.vec3:
    """The nearest vector in float32."""
    return wp.vec3(float(p[0]), float(p[1]), float(p[2]))


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
    x, y = brick % target.bricks[0], (brick / target.bricks[0]) % target.bricks[1]
    z = brick / (target.bricks[0] * target.bricks[1])
    piece = piece_of(target, item[i])
    triangle_out[LANES * at + lane] = piece.triangle
    corner = piece.corner - float(BRICK) * wp.vec3(float(x), float(y), float(z))
    # In float64: of a slim triangle's cross product float32 leaves a plane that misses its far corner.
    u, v = as_double(piece.edge_u), as_double(piece.edge_v)
    normal = wp.cross(u, v)
    square = wp.dot(normal, normal)
    longest = wp.max(wp.dot(v - u, v - u), wp.max(wp.dot(u, u), wp.dot(v, v)))
    thin = wp.float64(THINNEST * target.cells_per_unit)
    row = LANES * ROWS * at + lane
    if square > thin * thin * longest:
        unit = as_single(normal / wp.sqrt(square))
        along_u = as_single(wp.cross(v, normal) / square)
        along_v = as_single(wp.cross(normal, u) / square)
        at_u, at_v = -wp.dot(along_u, corner), -wp.dot(along_v, corner)
        if piece.kind == TRIANGLE:
            # Move the sides apart by a ray's rounding, which is many barycentric units where a triangle is slim.
            reach = ROUNDING * float(BRICK * wp.max(target.bricks))
            beside_u, beside_v = reach * wp.length(along_u), reach * wp.length(along_v)
            widening = 1.0 + beside_u + beside_v + reach * wp.length(along_u + along_v)
            along_u = along_u / widening
            along_v = along_v / widening
            at_u = (at_u + beside_u) / widening
            at_v = (at_v + beside_v) / widening
        for k in range(3):
            rows_out[row + k * LANES] = unit[k]
            rows_out[row + (4 + k) * LANES] = along_u[k]
            rows_out[row + (8 + k) * LANES] = along_v[k]
        rows_out[row + 3 * LANES] = wp.dot(unit, corner)
        rows_out[row + 7 * LANES] = at_u
        rows_out[row + 11 * LANES] = at_v
        rows_out[row + 12 * LANES] = piece.kind
    else:
        for k in range(ROWS):
            rows_out[row + k * LANES] = 0.0


def build_grid(geometry: DeviceMesh, resolution: int, quality: Quality, *, trusted: bool = False) -> Grid:
    """The occupancy grid of a mesh; ``quality`` chooses between triangles and patches.

    ``exact`` keeps every triangle; the others keep them unless they are much finer than patches of ``PATCH_TEXELS`` of
    the maps' texels, and smooth on that scale: patches then stand for them. In ``trusted`` maps, whose texels are
    smaller than what can be seen, they do so for rough surfaces and for smaller meshes, too.
    """
    triangles = len(geometry.faces)
    if quality != "exact" and triangles > (FEWEST_TRIANGLES if trusted else FEW_TRIANGLES):
        frame = texel_frame(geometry.mesh, max(1, round(resolution / PATCH_TEXELS[quality])))
        cells = FAST_GRID_CELLS if quality == "fast" else GRID_CELLS
        if trusted:
            cells = min(cells, int(BRICK) * max(2, round(CELLS_PER_TEXEL * max(frame.size) / int(BRICK))))
        target, ratio = _target(geometry, frame, cells)
        survey = Survey(geometry, frame, ratio, target.bricks)
        if survey.small > DENSE * survey.count * PATCH_TEXELS[quality] ** 2:
            if trusted:
                return _of_patches(target, survey, no_doubts(survey.patches()[0], target.bricks), geometry)
            doubts = doubts_of(frame, ratio, target.bricks, *survey.patches(), LARGEST_TURN[quality])
            if doubts.share < DOUBTFUL:
                return _of_patches(target, survey, doubts, geometry)
    cells = DENSE_GRID_CELLS if triangles > DENSE_TRIANGLES else GRID_CELLS
    target, _ = _target(geometry, texel_frame(geometry.mesh, resolution), cells)
    cell, item, _ = _cells_of(target, None, triangles, geometry.vertices.device)
    return Grid(_built(target, geometry, cell, item), cell.shape[0], False)


def _of_patches(target: Any, survey: Survey, doubts: Doubts, geometry: DeviceMesh) -> Grid:
    """Patches, and the triangles that none stands for."""
    target.patches, target.doubtful = doubts.patches, doubts.cells
    cell, item = _patches_and_the_rest(target, survey, doubts.near)
    view = _built(target, geometry, cell, item)
    view.front = float(survey.front)
    view.low, view.high = view.low - PATCH_RISE, view.high + PATCH_RISE
    return Grid(view, cell.shape[0], True)


def _target(geometry: DeviceMesh, frame: TexelFrame, cells: int) -> tuple[Any, float]:
    """The cells over a frame, and how many make a texel."""
    target = GridTarget()
    target.vertices, target.faces = geometry.vertices, geometry.faces
    ratio = cells / max(frame.size)
    target.cells_per_unit = ratio * frame.scale
    target.cell_offset = wp.vec3(*(ratio * np.array(frame.offset)))
    target.bricks = wp.vec3i(*(max(1, int(np.ceil(side * ratio / int(BRICK) - 1e-6))) for side in frame.size))
    return target, ratio


def _cells_of(
    target: Any, items: wp.array | None, count: int, device: wp.Device
) -> tuple[wp.array, wp.array, wp.array]:
    """(cell, item) of every pair that touches, and (cells,) uint8, 1 for cells touched; of the items listed, or else of
    all patches, or of all triangles where there are none."""
    listed = wp.empty(0, dtype=wp.int32, device=device) if items is None else items
    counts = wp.zeros(count + 1, dtype=wp.int32, device=device)
    masks = wp.empty(count, dtype=wp.uint64, device=device)
    launch.launch(find_cells, count, [target, listed, counts, masks], device)
    places, total = exclusive_scan(counts)
    cell, item = (wp.empty(total, dtype=wp.int32, device=device) for _ in range(2))
    touched = wp.zeros(_brick_count(target) * int(CELLS), dtype=wp.uint8, device=device)
    launch.launch(list_cells, count, [target, listed, masks, places, cell, item, touched], device)
    return cell, item, touched


def _brick_count(target: Any) -> int:
    return target.bricks[0] * target.bricks[1] * target.bricks[2]


def _patches_and_the_rest(target: Any, survey: Survey, near_doubt: wp.array) -> tuple[wp.array, wp.array]:
    """(cell, item) of all patches, and of the triangles that no patch stands for."""
    device = target.patches.device
    cell, item, touched = _cells_of(target, None, survey.count, device)
    kept = survey.kept_triangles(touched, near_doubt)
    if kept.shape[0] == 0:
        return cell, item
    more_cells, more_items, _ = _cells_of(target, kept, kept.shape[0], device)
    return _joined(cell, more_cells), _joined(item, more_items)


def _joined(a: wp.array, b: wp.array) -> wp.array:
    both = wp.empty(a.shape[0] + b.shape[0], dtype=a.dtype, device=a.device)
    wp.copy(both, a)
    wp.copy(both, b, dest_offset=a.shape[0])
    return both


def _built(target: Any, geometry: DeviceMesh, cell: wp.array, item: wp.array) -> Any:
    device = cell.device
    bricks = _brick_count(target)
    start, places = bin_items(cell, bricks * int(CELLS), device)
    occupied, blocks = (wp.zeros(bricks + 1, dtype=wp.int32, device=device) for _ in range(2))
    launch.launch(find_occupied_bricks, bricks, [start, occupied, blocks], device)
    number, occupied_count = exclusive_scan(occupied)
    first_block, block_count = exclusive_scan(blocks)
    view = GridView()
    view.brick = wp.empty(bricks, dtype=wp.int32, device=device)
    view.mask = wp.empty(max(occupied_count, 1), dtype=wp.uint64, device=device)
    view.block = wp.zeros(occupied_count * int(CELLS) + 1, dtype=wp.int32, device=device)
    view.rows = wp.empty(block_count * int(LANES) * int(ROWS), dtype=wp.float32, device=device)
    inputs = [start, number, first_block, view.brick, view.mask, view.block, view.rows]
    launch.launch(lay_out_bricks, bricks, inputs, device)
    view.leaps = wp.empty(8 * bricks, dtype=wp.uint8, device=device)
    launch.launch(find_leaps, 8, [view.brick, target.bricks, view.leaps], device)
    view.triangle = wp.empty(block_count * int(LANES), dtype=wp.int32, device=device)
    inputs = [target, cell, item, places, start, number, view.block, view.rows, view.triangle]
    launch.launch(fill_records, cell.shape[0], inputs, device)
    centre, half = geometry.mesh.unit_frame
    low, high = ((bound - centre) / half * target.cells_per_unit + target.cell_offset for bound in geometry.mesh.bounds)
    view.low, view.high = wp.vec3(*low), wp.vec3(*high)
    view.bricks, view.vertices, view.faces = target.bricks, geometry.vertices, geometry.faces
    view.cells_per_unit, view.cell_offset = target.cells_per_unit, target.cell_offset
    return view
