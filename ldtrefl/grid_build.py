"""Mesh -> occupancy grid (``grid.py``): make the records, find the cells they touch, lay out what is occupied.

patches, or triangles -> (cell, record) pairs -> sort by cell and place -> blocks of records, boxes, leaps
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import warp as wp

from ldtrefl import launch
from ldtrefl.binning import bin_items, exclusive_scan
from ldtrefl.budget import memory_limit
from ldtrefl.cubemap import TexelFrame, bulk_frame, texel_frame
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.doubts import Doubts, doubts_of, no_doubts
from ldtrefl.errors import InputError
from ldtrefl.grid import (
    LANES,
    LARGE,
    PATCH_ROWS,
    SIDES,
    TRIANGLE,
    TRIANGLE_ROWS,
    Grid,
    GridView,
    cell_number,
    number_of_cell,
)
from ldtrefl.patches import PATCH_MARGIN, Survey
from ldtrefl.pieces import CELL_MARGIN, SUBCELLS, Piece, high_corner, low_corner, subcell, touches_cell
from ldtrefl.vectors import as_double, as_single

Quality = Literal["fast", "balanced", "exact"]

FEWEST_CELLS, MOST_CELLS = 8, 64
CELLS_PER_ROOT = 0.08
"""Cells along the longest side per square root of the records, from the fewest to the most: some 50 to 200 records then
lie in an occupied cell. Of 16, 24, 32, 36 and 48 the fastest on knots and scans of 10,000 to 100,000, within 4%."""
SURVEY_CELLS = 48
"""Cells along the longest side in which patches and triangles are told apart."""
SURVEY_CELLS_PER_PATCH = 0.5
"""The same for coarser maps: cells to the side of a patch, which must be smaller than a cell."""

PATCH_TEXELS: dict[Quality, float] = {"fast": 4.0, "balanced": 1.6}
"""Texels along a side of a patch. The plane of one is off by the square of its side: on a torus knot at 256, 1.6 texels
give 0.1% wrong hits and a tenth of a texel of 128 at the 99th percentile; 1.75 a fifth more at 3% less time."""

LARGEST_TURN: dict[Quality, float] = {"fast": 0.5, "balanced": 1.6}
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
PATCH_RISE = 1.0 / 3.0
"""Of a patch's side, by which the box is widened for patches that rise out of it where the surface bends. Without it
one ray in ten thousand slipped under them to the far wall."""
HORIZON = 1.0 / 3.0
"""Of a patch's side, how far past a doubted hit a search goes on."""
ROUNDING = wp.constant(1.5e-7)
"""Of a ray's coordinates in cells, relative to the grid's size: two roundings of a float32."""
THINNEST = wp.constant(6.0e-7)
"""Height, in unit space, below which a triangle has no area: it is ten roundings of its corners, its normal chance."""
MASK_BITS = wp.constant(64)
"""Cells of an item's box up to which it is kept which of them it touches: that is the dearest thing to find out."""
MOST_RECORDS = 150_000_000
"""Records of a grid: the numbers of their floats fit in an int32."""
BYTES_PER_RECORD = 80
"""What a record takes, and what it is made from, at most."""
LARGEST_LEAP = wp.constant(250)
"""Cells: what fits in a byte, and more than a grid has."""
EMPTY = wp.constant(1.0e30)
"""Sides of a box with nothing in it: its low is above its high."""


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
    cells_per_survey_cell: float
    cells_per_unit: float
    cell_offset: wp.vec3
    cells: wp.vec3i


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
    piece = target.patches[-1 - item]
    piece.corner = target.cells_per_survey_cell * piece.corner
    piece.edge_u = target.cells_per_survey_cell * piece.edge_u
    piece.edge_v = target.cells_per_survey_cell * piece.edge_v
    return piece


@wp.func
def cells_touched(target: GridTarget, piece: Piece) -> CellBox:
    """The cells of the box about a piece."""
    low, high = low_corner(piece), high_corner(piece)
    nx, ny, nz = target.cells[0], target.cells[1], target.cells[2]
    m = CELL_MARGIN
    box = CellBox()
    box.first = wp.vec3i(cell_number(low[0] - m, nx), cell_number(low[1] - m, ny), cell_number(low[2] - m, nz))
    box.last = wp.vec3i(cell_number(high[0] + m, nx), cell_number(high[1] + m, ny), cell_number(high[2] + m, nz))
    return box


@wp.func
def item_number(items: wp.array(dtype=wp.int32), i: int) -> int:
    """The ``i``-th item: of those listed; else of all triangles."""
    if items.shape[0] > 0:
        return items[i]
    return i


@wp.func
def fits_mask(box: CellBox) -> bool:
    """Whether a box has no more cells than a mask has bits."""
    n = box.last - box.first + wp.vec3i(1)
    return wp.int64(n[0]) * wp.int64(n[1]) * wp.int64(n[2]) <= wp.int64(MASK_BITS)


@launch.kernel
def find_cells(
    first: int,
    # In:
    target: GridTarget,
    items: wp.array(dtype=wp.int32),
    # Out:
    counts_out: wp.array(dtype=wp.int64),  # their sum may be larger than an int32
    masks_out: wp.array(dtype=wp.uint64),  # bit k: the item touches cell k of its box; of small boxes only
    touched_out: wp.array(dtype=wp.int32),  # 1 for cells with an item: the same value from whoever writes
):
    i = first + wp.tid()
    piece = piece_of(target, item_number(items, i))
    box = cells_touched(target, piece)
    is_one_cell = box.first == box.last
    is_masked = fits_mask(box)
    count = int(0)
    mask = wp.uint64(0)
    bit = wp.uint64(1)
    for z in range(box.first[2], box.last[2] + 1):
        for y in range(box.first[1], box.last[1] + 1):
            for x in range(box.first[0], box.last[0] + 1):
                if is_one_cell or touches_cell(piece, x, y, z):
                    count += 1
                    touched_out[number_of_cell(target.cells, x, y, z)] = 1
                    if is_masked:
                        mask = mask | bit
                bit = bit << wp.uint64(1)
    counts_out[i] = wp.int64(count)
    masks_out[i] = mask


@launch.kernel
def list_cells(
    first: int,
    # In:
    target: GridTarget,
    items: wp.array(dtype=wp.int32),
    masks: wp.array(dtype=wp.uint64),
    places: wp.array(dtype=wp.int64),
    number: wp.array(dtype=wp.int32),
    # Out:
    part_out: wp.array(dtype=wp.int32),  # the subcell, for patches and for triangles, of the occupied cell
    item_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    place = int(places[i])
    item = item_number(items, i)
    piece = piece_of(target, item)
    box = cells_touched(target, piece)
    is_masked = fits_mask(box)
    mask = masks[i]
    for z in range(box.first[2], box.last[2] + 1):
        for y in range(box.first[1], box.last[1] + 1):
            for x in range(box.first[0], box.last[0] + 1):
                is_touched = (mask & wp.uint64(1)) != wp.uint64(0)
                if not is_masked:
                    is_touched = touches_cell(piece, x, y, z)
                if is_touched:
                    cell = number[number_of_cell(target.cells, x, y, z)]
                    which = wp.where(piece.kind == TRIANGLE, 1, 0)
                    part_out[place] = SUBCELLS * (2 * cell + which) + subcell(piece, x, y, z)
                    item_out[place] = item
                    place += 1
                mask = mask >> wp.uint64(1)


@launch.kernel
def put_in_order(
    first: int,
    # In:
    item: wp.array(dtype=wp.int32),
    part: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    # Out:
    item_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    item_out[start[part[i]] + ranks[i]] = item[i]


@launch.kernel
def measure_lists(
    first: int,
    # In:
    start: wp.array(dtype=wp.int32),
    number: wp.array(dtype=wp.int32),
    # Out: per occupied cell, its place among all; per list, rows and nodes
    cell_out: wp.array(dtype=wp.int32),
    rows_out: wp.array(dtype=wp.int32),
    nodes_out: wp.array(dtype=wp.int32),
):
    cell = first + wp.tid()
    occupied = number[cell]
    is_occupied = occupied < number[cell + 1]
    if is_occupied:
        cell_out[occupied] = cell
    for which in range(2):
        blocks = int(0)
        if is_occupied:
            part = SUBCELLS * (2 * occupied + which)
            blocks = (start[part + SUBCELLS] - start[part] + LANES - 1) / LANES
        rows_out[2 * cell + which] = blocks * wp.where(which == 0, PATCH_ROWS, TRIANGLE_ROWS)
        nodes_out[2 * cell + which] = (blocks + LANES - 1) / LANES


@launch.kernel
def find_leaps(
    first: int,
    # In:
    node: wp.array(dtype=wp.int32),
    cells: wp.vec3i,
    # Out:
    leaps_out: wp.array(dtype=wp.uint8),
):
    # The largest empty cube of cells that starts at a cell and grows along the octant is one larger than the
    # smallest of its seven neighbours' that way; beyond the grid all is empty.
    octant = first + wp.tid()
    nx, ny, nz = cells[0], cells[1], cells[2]
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
                if node[2 * i] == node[2 * i + 2]:
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
def write_patch(piece: Piece, cell: wp.vec3, row: int, rows: wp.array(dtype=float)):
    """Write a patch in a cell as the record at ``row``."""
    middle = piece.corner - cell + 0.5 * (piece.edge_u + piece.edge_v)
    unit = wp.normalize(wp.cross(piece.edge_u, piece.edge_v))
    axis = piece.kind % LARGE
    for k in range(3):
        rows[row + k * LANES] = unit[k]
    rows[row + 3 * LANES] = wp.dot(unit, middle)
    rows[row + 4 * LANES] = middle[(axis + 1) % 3]
    rows[row + 5 * LANES] = middle[(axis + 2) % 3]
    rows[row + 6 * LANES] = wp.cast(piece.triangle, wp.float32)
    rows[row + 7 * LANES] = wp.cast(piece.kind, wp.float32)


@wp.func
def write_triangle(target: GridTarget, piece: Piece, cell: wp.vec3, row: int, rows: wp.array(dtype=float)):
    """Write a triangle in a cell as the record at ``row``; of one without area nothing but 0."""
    # In float64: of a slim triangle's cross product float32 leaves a plane that misses its far corner.
    u, v = as_double(piece.edge_u), as_double(piece.edge_v)
    normal = wp.cross(u, v)
    square = wp.dot(normal, normal)
    longest = wp.max(wp.dot(v - u, v - u), wp.max(wp.dot(u, u), wp.dot(v, v)))
    thinnest = wp.float64(THINNEST * target.cells_per_unit)
    if not square > thinnest * thinnest * longest:
        for k in range(TRIANGLE_ROWS):
            rows[row + k * LANES] = 0.0
        return
    corner = piece.corner - cell
    unit = as_single(normal / wp.sqrt(square))
    along_u = as_single(wp.cross(v, normal) / square)
    along_v = as_single(wp.cross(normal, u) / square)
    # Move the sides apart by a ray's rounding, which is many barycentric units where a triangle is slim.
    reach = ROUNDING * float(wp.max(target.cells))
    beside_u, beside_v = reach * wp.length(along_u), reach * wp.length(along_v)
    widening = 1.0 + beside_u + beside_v + reach * wp.length(along_u + along_v)
    for k in range(3):
        rows[row + k * LANES] = unit[k]
        rows[row + (4 + k) * LANES] = along_u[k] / widening
        rows[row + (8 + k) * LANES] = along_v[k] / widening
    rows[row + 3 * LANES] = wp.dot(unit, corner)
    rows[row + 7 * LANES] = (beside_u - wp.dot(along_u, corner)) / widening
    rows[row + 11 * LANES] = (beside_v - wp.dot(along_v, corner)) / widening
    rows[row + 12 * LANES] = wp.cast(piece.triangle, wp.float32)


@launch.kernel
def fill_cells(
    first: int,
    # In:
    target: GridTarget,
    items: wp.array(dtype=wp.int32),  # in the order of their subcells
    start: wp.array(dtype=wp.int32),
    cell: wp.array(dtype=wp.int32),
    node: wp.array(dtype=wp.int32),
    row: wp.array(dtype=wp.int32),
    # Out:
    boxes_out: wp.array(dtype=wp.float32),
    rows_out: wp.array(dtype=wp.float32),
):
    occupied = first + wp.tid()
    number = cell[occupied]
    nx, ny = target.cells[0], target.cells[1]
    corner = wp.vec3(float(number % nx), float((number / nx) % ny), float(number / (nx * ny)))
    for which in range(2):
        begin = int(start[SUBCELLS * (2 * occupied + which)])
        end = int(start[SUBCELLS * (2 * occupied + which + 1)])
        first_node, end_node = int(node[2 * number + which]), int(node[2 * number + which + 1])
        height = wp.where(which == 0, PATCH_ROWS, TRIANGLE_ROWS)
        for block in range(LANES * (end_node - first_node)):
            at = LANES * (row[2 * number + which] + height * block)
            low, high = wp.vec3(EMPTY), wp.vec3(-EMPTY)
            for lane in range(LANES):
                i = begin + LANES * block + lane
                if i < end:
                    piece = piece_of(target, items[i])
                    low = wp.min(low, low_corner(piece))
                    high = wp.max(high, high_corner(piece))
                    if which == 0:
                        write_patch(piece, corner, at + lane, rows_out)
                    else:
                        write_triangle(target, piece, corner, at + lane, rows_out)
                elif begin + LANES * block < end:
                    for k in range(height):
                        rows_out[at + k * LANES + lane] = 0.0
            # What lies outside the cell is another's.
            low = wp.max(low - corner, wp.vec3(0.0)) - wp.vec3(CELL_MARGIN)
            high = wp.min(high - corner, wp.vec3(1.0)) + wp.vec3(CELL_MARGIN)
            side = LANES * SIDES * (first_node + block / LANES) + block % LANES
            for axis in range(3):
                boxes_out[side + 2 * axis * LANES] = low[axis]
                boxes_out[side + (2 * axis + 1) * LANES] = high[axis]


def build_grid(geometry: DeviceMesh, resolution: int, quality: Quality, *, trusted: bool = False) -> Grid:
    """The occupancy grid of a mesh; ``quality`` chooses between triangles and patches.

    ``exact`` keeps every triangle; the others keep them unless they are much finer than patches of ``PATCH_TEXELS`` of
    the maps' texels, and smooth on that scale: patches then stand for them. In ``trusted`` maps, whose texels are
    smaller than what can be seen, they do so for rough surfaces and for smaller meshes, too.
    """
    mesh, triangles = geometry.mesh, len(geometry.faces)
    if quality != "exact" and len(mesh.strays) == 0 and triangles > (FEWEST_TRIANGLES if trusted else FEW_TRIANGLES):
        frame = texel_frame(mesh, max(1, round(resolution / PATCH_TEXELS[quality])))
        survey = Survey(geometry, frame, max(1, min(SURVEY_CELLS, round(SURVEY_CELLS_PER_PATCH * max(frame.size)))))
        if survey.small > DENSE * survey.count * PATCH_TEXELS[quality] ** 2:
            doubts = no_doubts(survey) if trusted else doubts_of(survey, LARGEST_TURN[quality])
            made = _of_patches(geometry, survey, doubts) if doubts.share < DOUBTFUL else None
            if made is not None:
                return made
    bulk = triangles - len(mesh.strays)
    frame, items = bulk_frame(mesh, resolution), _listed_bulk(geometry)
    cells = _cells_for(bulk)
    while cells >= 1:
        target, _ = _target(geometry, frame, cells)
        built = _built(target, geometry, items, bulk)
        if built is not None:
            return Grid(*built, False)
        cells //= 2  # triangles as large as the mesh lie in thousands of cells each
    raise InputError(f"the mesh has {triangles} triangles, too many to search (--memory allows {memory_limit()} bytes)")


def _listed_bulk(geometry: DeviceMesh) -> wp.array:
    """The triangles that are no strays; an empty list if there are none."""
    strays = geometry.mesh.strays
    bulk = np.delete(np.arange(len(geometry.faces), dtype=np.int32), strays) if len(strays) else np.zeros(0, np.int32)
    return wp.array(bulk, dtype=wp.int32, device=geometry.vertices.device)


def _of_patches(geometry: DeviceMesh, survey: Survey, doubts: Doubts) -> Grid | None:
    """Patches, and the triangles that none stands for; None if those lie in too many cells."""
    patches, touched = doubts.sure_patches()
    items = _joined(patches, survey.kept_triangles(touched, doubts.near))
    target, cells_per_texel = _target(geometry, survey.frame, _cells_for(items.shape[0]))
    target.patches, target.cells_per_survey_cell = doubts.patches, cells_per_texel / survey.cells_per_texel
    built = _built(target, geometry, items, items.shape[0])
    if built is None:
        return None
    view, records = built
    view.front, view.horizon = float(survey.front), HORIZON * cells_per_texel
    view.half_patch = (0.5 + PATCH_MARGIN) * cells_per_texel
    rise = wp.vec3(PATCH_RISE * cells_per_texel)
    view.low, view.high = view.low - rise, view.high + rise
    return Grid(view, records, True)


def _cells_for(items: int) -> int:
    """Cells along the longest side for so many items."""
    return min(max(round(CELLS_PER_ROOT * math.sqrt(items)), FEWEST_CELLS), MOST_CELLS)


def _target(geometry: DeviceMesh, frame: TexelFrame, cells: int) -> tuple[Any, float]:
    """The cells over a frame, so many along its longest side, and how many make a texel."""
    ratio = cells / max(frame.size)
    target = GridTarget()
    target.vertices, target.faces = geometry.vertices, geometry.faces
    target.cells_per_unit = ratio * frame.scale
    target.cell_offset = wp.vec3(*(ratio * np.array(frame.offset)))
    target.cells = wp.vec3i(*frame.cells(cells))
    return target, ratio


def _joined(a: wp.array, b: wp.array) -> wp.array:
    if b.shape[0] == 0:
        return a
    both = wp.empty(a.shape[0] + b.shape[0], dtype=a.dtype, device=a.device)
    wp.copy(both, a)
    wp.copy(both, b, dest_offset=a.shape[0])
    return both


def _built(target: Any, geometry: DeviceMesh, items: wp.array, count: int) -> tuple[Any, int] | None:
    """The grid of ``count`` items, those listed or else all triangles, and its records; None if they are too many."""
    device = geometry.vertices.device
    cells = target.cells[0] * target.cells[1] * target.cells[2]
    view = GridView()

    # Find the pairs of cell and item.
    counts = wp.zeros(count + 1, dtype=wp.int64, device=device)
    touched = wp.zeros(cells + 1, dtype=wp.int32, device=device)
    masks = wp.empty(count, dtype=wp.uint64, device=device)
    launch.launch(find_cells, count, [target, items, counts, masks, touched], device)
    places, records = exclusive_scan(counts)
    if records > min(MOST_RECORDS, memory_limit() // BYTES_PER_RECORD):
        return None
    number, occupied = exclusive_scan(touched)
    part, item = (wp.empty(records, dtype=wp.int32, device=device) for _ in range(2))
    launch.launch(list_cells, count, [target, items, masks, places, number, part, item], device)

    # Sort them by cell, and by where they lie in it.
    start, ranks = bin_items(part, 2 * occupied * int(SUBCELLS), device)
    ordered = wp.empty_like(item)
    launch.launch(put_in_order, records, [item, part, start, ranks, ordered], device)

    # Lay out blocks of records, and the boxes about them.
    cell = wp.empty(occupied, dtype=wp.int32, device=device)
    rows, nodes = (wp.zeros(2 * cells + 1, dtype=wp.int32, device=device) for _ in range(2))
    launch.launch(measure_lists, cells, [start, number, cell, rows, nodes], device)
    view.row, row_count = exclusive_scan(rows)
    view.node, node_count = exclusive_scan(nodes)
    view.boxes = wp.empty(node_count * int(LANES * SIDES), dtype=wp.float32, device=device)
    view.rows = wp.empty(row_count * int(LANES), dtype=wp.float32, device=device)
    inputs = [target, ordered, start, cell, view.node, view.row, view.boxes, view.rows]
    launch.launch(fill_cells, occupied, inputs, device)
    view.leaps = wp.empty(8 * cells, dtype=wp.uint8, device=device)
    launch.launch(find_leaps, 8, [view.node, target.cells, view.leaps], device)

    centre, half = geometry.mesh.unit_frame
    low, high = ((bound - centre) / half * target.cells_per_unit + target.cell_offset for bound in geometry.mesh.bulk)
    view.low, view.high = wp.vec3(*low), wp.vec3(*high)
    view.cells, view.vertices, view.faces = target.cells, geometry.vertices, geometry.faces
    view.strays = geometry.strays
    view.cells_per_unit, view.cell_offset = target.cells_per_unit, target.cell_offset
    return view, records
