"""Mesh -> patches: where many triangles share a texel, the texels lifted to the surface stand for them.

A *patch* is a fragment of the maps (``peel.py``) as a piece of its triangle's plane, one texel wide, kept in the maps
whose axis it faces. Triangles of more than two texels get none: they stay triangles. All are surveyed once, in chunks:
how many patches each chunk gives, the corners of the triangles that give them (few, where a mesh is dense), which cell
each triangle lies in, and whether the mesh is closed. What follows looks at those few alone.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device.bins import CHUNK, chunk_count, exclusive_scan, gather_lists, launch_chunks
from ldtrefl.device.launch import kernel
from ldtrefl.geometry.fixed_raster import (
    TEXEL_OF_SUBTEXEL,
    FixedTriangle,
    cover,
    first_centre,
    fixed_triangle,
    interpolate,
    last_centre,
    unsnap,
)
from ldtrefl.ldt.exact.pieces import LARGE, Piece, cell_number, number_of_cell
from ldtrefl.ldt.peel import snapped_vertices
from ldtrefl.ldt.texel_frame import TexelFrame, point_from_texel
from ldtrefl.world.device_mesh import DeviceMesh

FACING = wp.constant(0.55)
"""|n . axis| from which a map keeps a fragment as a patch: every direction faces one of the three with 0.577 or more.
At 0.577 itself, where two maps meet on a bent surface, twice as many rays slipped between their patches."""
PATCH_MARGIN = wp.constant(0.08)
"""Part of a patch's side added around it, so that neighbours on a bent surface overlap instead of leaving a slit. With
0.02 one ray in a thousand slipped through to the far wall, specks in the picture; with 0.06 one in ten thousand, at a
fifth more wrong hits along silhouettes."""
TOO_LARGE = wp.constant(2 << 16)
"""Fixed-point texels across from which a triangle of a dense mesh is kept as it is."""
KEPT = wp.constant(-1)
"""Stands for the cell of a triangle that is kept as it is."""


@wp.struct
class PatchTarget:
    """The mesh in the box of texels that its patches are made in, and the cells of the survey over them."""

    fixed: wp.array(dtype=wp.vec4i)  # vertices in fixed-point texels, and a hash of their place
    faces: wp.array(dtype=wp.vec3i)
    size: wp.vec3i  # texels
    first_texel: wp.vec3i  # of each axis' map
    facing_most: float  # |n . axis| over the largest of the three from which a map keeps a fragment
    cells_per_texel: float
    cells: wp.vec3i


@wp.struct
class Corners:
    """A triangle that gives patches."""

    a: wp.vec4i  # fixed-point texels, and the hash
    b: wp.vec4i
    c: wp.vec4i
    triangle: int


@wp.func
def holds_centre(low: int, high: int) -> int:
    """1 if a texel's centre lies from ``low`` to ``high``, else 0."""
    return wp.where(first_centre(low) <= last_centre(high), 1, 0)


@wp.func
def fixed_normal(a: wp.vec4i, b: wp.vec4i, c: wp.vec4i) -> wp.vec3:
    """Unit normal of a triangle; 0 for one without area."""
    u = wp.vec3(float(b[0] - a[0]), float(b[1] - a[1]), float(b[2] - a[2]))
    v = wp.vec3(float(c[0] - a[0]), float(c[1] - a[1]), float(c[2] - a[2]))
    return wp.normalize(wp.cross(u, v))


@wp.func
def faces_map(normal: wp.vec3, axis: int, facing_most: float) -> bool:
    """Whether a map keeps fragments of this unit normal as patches."""
    across = wp.max(wp.abs(normal[(axis + 1) % 3]), wp.abs(normal[(axis + 2) % 3]))
    return wp.abs(normal[axis]) >= wp.max(FACING, facing_most * across)


@wp.func
def facing_triangle(
    target: PatchTarget, axis: int, a: wp.vec4i, b: wp.vec4i, c: wp.vec4i, normal: wp.vec3
) -> FixedTriangle:
    """A triangle in the map of ``axis``; area 0 if the map does not face it."""
    if not faces_map(normal, axis, target.facing_most):
        return FixedTriangle()
    u, v = (axis + 1) % 3, (axis + 2) % 3
    return fixed_triangle(a[u], a[v], b[u], b[v], c[u], c[v], target.size[u], target.size[v])


@wp.func
def patch_piece(target: PatchTarget, giver: Corners, axis: int, u: int, v: int, depth: float, normal: wp.vec3) -> Piece:
    """The plane of a triangle over a texel of the map of ``axis``, a little wider than the texel."""
    slope_u, slope_v = -normal[(axis + 1) % 3] / normal[axis], -normal[(axis + 2) % 3] / normal[axis]
    half = 0.5 + PATCH_MARGIN
    corner = wp.vec3(float(u) - PATCH_MARGIN, float(v) - PATCH_MARGIN, depth - half * (slope_u + slope_v))
    along_u = 2.0 * half * target.cells_per_texel * point_from_texel(axis, wp.vec3(1.0, 0.0, slope_u))
    along_v = 2.0 * half * target.cells_per_texel * point_from_texel(axis, wp.vec3(0.0, 1.0, slope_v))
    piece = Piece()
    piece.corner = target.cells_per_texel * point_from_texel(axis, corner)
    # The record's normal is the triangle's.
    piece.edge_u = wp.where(normal[axis] < 0.0, along_v, along_u)
    piece.edge_v = wp.where(normal[axis] < 0.0, along_u, along_v)
    piece.kind = axis
    for i in range(3):
        longest = wp.max(giver.a[i], wp.max(giver.b[i], giver.c[i])) - wp.min(
            giver.a[i], wp.min(giver.b[i], giver.c[i])
        )
        if unsnap(longest) > 1.0:
            piece.kind = axis + LARGE
    piece.triangle = giver.triangle
    return piece


@wp.func
def lift_texels(
    target: PatchTarget,
    giver: Corners,
    place: int,
    patches_out: wp.array(dtype=Piece),
    texel_out: wp.array(dtype=wp.int32),
) -> int:
    """Count the texel centres that a triangle covers in the maps that face it; make their patches from ``place`` on,
    unless it is negative."""
    a, b, c = giver.a, giver.b, giver.c
    normal = fixed_normal(a, b, c)
    count = int(0)
    for axis in range(3):
        tri = facing_triangle(target, axis, a, b, c, normal)
        if tri.area != wp.int64(0):
            for v in range(tri.first_v, tri.last_v + 1):
                for u in range(tri.first_u, tri.last_u + 1):
                    at = cover(tri, u, v)
                    if at.covered:
                        if place >= 0:
                            depth = interpolate(tri, at, unsnap(a[axis]), unsnap(b[axis]), unsnap(c[axis]))
                            patches_out[place + count] = patch_piece(target, giver, axis, u, v, depth, normal)
                            texel_out[place + count] = target.first_texel[axis] + v * target.size[(axis + 1) % 3] + u
                        count += 1
    return count


@kernel
def survey_triangles(
    first: int,
    # In:
    target: PatchTarget,
    no_patches: wp.array(dtype=Piece),
    no_texels: wp.array(dtype=wp.int32),
    # Out, per chunk: small triangles; patches; triangles that give some, and their corners; what is left open; volume
    small_out: wp.array(dtype=wp.int32),
    patches_out: wp.array(dtype=wp.int32),
    givers_out: wp.array(dtype=wp.int32),
    corners_out: wp.array(dtype=Corners),
    open_out: wp.array(dtype=wp.uint64),
    volume_out: wp.array(dtype=wp.float64),
    # Out, per triangle: the cell of its middle, or KEPT
    cell_out: wp.array(dtype=wp.int32),
):
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    nx, ny, nz = target.cells[0], target.cells[1], target.cells[2]
    third = target.cells_per_texel * TEXEL_OF_SUBTEXEL / 3.0
    small = int(0)
    patches = int(0)
    givers = int(0)
    left_open = wp.uint64(0)
    volume = wp.float64(0.0)
    for triangle in range(begin, wp.min(begin + CHUNK, target.faces.shape[0])):
        corners = target.faces[triangle]
        a, b, c = target.fixed[corners[0]], target.fixed[corners[1]], target.fixed[corners[2]]
        # A sum over directed edges that changes its sign with an edge's direction: 0 where every edge has its
        # opposite. For h = a b (b - a) of the vertices' hashes, a triangle's share is this product.
        ha, hb, hc = wp.uint64(wp.uint32(a[3])), wp.uint64(wp.uint32(b[3])), wp.uint64(wp.uint32(c[3]))
        left_open += (ha - hb) * (hb - hc) * (hc - ha)
        base = wp.int64(b[0] - a[0]) * wp.int64(c[1] - a[1]) - wp.int64(b[1] - a[1]) * wp.int64(c[0] - a[0])
        volume += wp.float64(base) * wp.float64(float(a[2]) + float(b[2]) + float(c[2]))

        low_x, high_x = wp.min(a[0], wp.min(b[0], c[0])), wp.max(a[0], wp.max(b[0], c[0]))
        low_y, high_y = wp.min(a[1], wp.min(b[1], c[1])), wp.max(a[1], wp.max(b[1], c[1]))
        low_z, high_z = wp.min(a[2], wp.min(b[2], c[2])), wp.max(a[2], wp.max(b[2], c[2]))
        if wp.max(high_x - low_x, wp.max(high_y - low_y, high_z - low_z)) > TOO_LARGE:
            cell_out[triangle] = KEPT
        else:
            small += 1
            x = cell_number(third * (float(a[0]) + float(b[0]) + float(c[0])), nx)
            y = cell_number(third * (float(a[1]) + float(b[1]) + float(c[1])), ny)
            z = cell_number(third * (float(a[2]) + float(b[2]) + float(c[2])), nz)
            cell_out[triangle] = number_of_cell(target.cells, x, y, z)
            # Most triangles of a dense mesh lie between texel centres along two axes and end here.
            if holds_centre(low_x, high_x) + holds_centre(low_y, high_y) + holds_centre(low_z, high_z) >= 2:
                giver = Corners()
                giver.a = a
                giver.b = b
                giver.c = c
                giver.triangle = triangle
                given = lift_texels(target, giver, -1, no_patches, no_texels)
                if given > 0:
                    corners_out[begin + givers] = giver
                    givers += 1
                    patches += given
    small_out[chunk] = small
    patches_out[chunk] = patches
    givers_out[chunk] = givers
    open_out[chunk] = left_open
    volume_out[chunk] = volume


@kernel
def make_patches(
    first: int,
    # In:
    target: PatchTarget,
    places: wp.array(dtype=wp.int32),
    givers: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=Corners),
    # Out:
    patches_out: wp.array(dtype=Piece),
    texel_out: wp.array(dtype=wp.int32),
):
    chunk = first + wp.tid()
    place = int(places[chunk])
    for k in range(givers[chunk]):
        place += lift_texels(target, corners[CHUNK * chunk + k], place, patches_out, texel_out)


@kernel
def list_kept(
    first: int,
    # In:
    cell: wp.array(dtype=wp.int32),
    has_patch: wp.array(dtype=wp.uint8),
    near_doubt: wp.array(dtype=wp.uint8),
    # Out, per chunk: triangles that no patch stands for, and their list
    count_out: wp.array(dtype=wp.int32),
    list_out: wp.array(dtype=wp.int32),
):
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    count = int(0)
    for triangle in range(begin, wp.min(begin + CHUNK, cell.shape[0])):
        is_kept = bool(cell[triangle] == KEPT)
        if not is_kept:
            is_kept = has_patch[cell[triangle]] == wp.uint8(0) or near_doubt[cell[triangle]] != wp.uint8(0)
        if is_kept:
            list_out[begin + count] = triangle
            count += 1
    count_out[chunk] = count


class Survey:
    """The survey of a mesh's triangles in a box of texels, with ``cells`` along its longest side. A map keeps what has
    ``facing_most`` of the largest of the three |n . axis| along its own axis."""

    def __init__(self, geometry: DeviceMesh, frame: TexelFrame, cells: int, facing_most: float) -> None:
        self._device, self.triangles = geometry.vertices.device, len(geometry.faces)
        self.frame, self.cells_per_texel = frame, cells / max(frame.size)
        self.cells = wp.vec3i(*frame.cells(cells))
        target = PatchTarget()
        target.fixed, target.faces = snapped_vertices(geometry, frame), geometry.faces
        target.size, target.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
        target.facing_most = facing_most
        target.cells_per_texel, target.cells = self.cells_per_texel, self.cells
        self._target = target
        chunks = chunk_count(self.triangles)
        small, counts, self._givers = (wp.zeros(chunks + 1, dtype=wp.int32, device=self._device) for _ in range(3))
        self._corners = wp.empty(self.triangles, dtype=Corners, device=self._device)
        self._cell = wp.empty(self.triangles, dtype=wp.int32, device=self._device)
        self._open = wp.empty(chunks, dtype=wp.uint64, device=self._device)
        self._volume = wp.empty(chunks, dtype=wp.float64, device=self._device)
        nothing = wp.empty(0, dtype=Piece, device=self._device)
        nowhere = wp.empty(0, dtype=wp.int32, device=self._device)
        outputs = [small, counts, self._givers, self._corners, self._open, self._volume, self._cell]
        launch_chunks(survey_triangles, self.triangles, [target, nothing, nowhere, *outputs], self._device)
        self._places, self.count = exclusive_scan(counts)
        self.small = int(small.numpy().sum())
        """Triangles of at most two texels."""

    @functools.cached_property
    def front(self) -> int:
        """The sign of a triangle's side that looks out of a closed mesh: 1 if its normal does, -1 if it looks in; 0
        if the mesh is open, or wound one way here and the other there."""
        if self._open.numpy().sum(dtype=np.uint64) != 0:
            return 0
        return int(np.sign(self._volume.numpy().sum()))

    def patches(self) -> tuple[wp.array, wp.array]:
        """(count,) ``Piece``, and (count,) int32, the texel of each, the three axes' maps in a row."""
        made = wp.empty(self.count, dtype=Piece, device=self._device)
        texel = wp.empty(self.count, dtype=wp.int32, device=self._device)
        inputs: list[Any] = [self._target, self._places, self._givers, self._corners, made, texel]
        launch_chunks(make_patches, self.triangles, inputs, self._device)
        return made, texel

    def kept_triangles(self, has_patch: wp.array, near_doubt: wp.array) -> wp.array:
        """The triangles that no patch stands for, in order: large ones, and those in cells that no patch touches, such
        as wires between texel centres, or near doubtful ones."""
        counts = wp.zeros(chunk_count(self.triangles) + 1, dtype=wp.int32, device=self._device)
        listed = wp.empty(self.triangles, dtype=wp.int32, device=self._device)
        launch_chunks(list_kept, self.triangles, [self._cell, has_patch, near_doubt, counts, listed], self._device)
        return gather_lists(listed, counts)
