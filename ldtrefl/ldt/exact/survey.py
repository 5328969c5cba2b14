"""The survey of a mesh's triangles: how many patches they give, where they lie, and whether the mesh is closed.

Where many triangles share a texel, patches (``patches.py``) stand for them. Triangles of more than two texels give
none: they stay triangles. All triangles are surveyed once, in chunks: how many patches each chunk gives, the corners of
the triangles that give them (few, where a mesh is dense), which cell each triangle lies in, and the sums that tell
whether the mesh is closed. What follows looks at those few alone.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device.bins import CHUNK, chunk_count, exclusive_scan, gather_lists, launch_chunks
from ldtrefl.device.launch import kernel
from ldtrefl.geometry.box import cell_holding, cell_number
from ldtrefl.geometry.fixed_raster import TEXEL_OF_SUBTEXEL, first_centre, last_centre
from ldtrefl.ldt.exact.patch import Patch
from ldtrefl.ldt.exact.patches import COUNT_ONLY, PatchList, PatchTarget, SnappedTriangle, lift_texels
from ldtrefl.ldt.fragments import snapped_vertices
from ldtrefl.ldt.texel_frame import TexelFrame
from ldtrefl.world.device_mesh import DeviceMesh

TOO_LARGE = wp.constant(2 << 16)
"""Fixed-point texels across from which a triangle of a dense mesh stays a triangle: two texels."""
NO_CELL = wp.constant(-1)
"""In place of the cell of a triangle that is too large for patches."""


@wp.struct
class SurveyResults:
    """What the survey finds."""

    # Per chunk of triangles:
    small: wp.array(dtype=wp.int32)  # triangles of at most two texels
    patches: wp.array(dtype=wp.int32)
    patched: wp.array(dtype=wp.int32)  # triangles that give patches
    open_edges: wp.array(dtype=wp.uint64)  # the sum of ``edge_sum``
    volume: wp.array(dtype=wp.float64)  # the sum of ``volume_below``
    # Per triangle:
    patched_triangles: wp.array(dtype=SnappedTriangle)  # a chunk's stand from its first triangle's place on
    cell: wp.array(dtype=wp.int32)  # of its middle, or NO_CELL


@wp.func
def snapped_triangle(target: PatchTarget, triangle: int) -> SnappedTriangle:
    """A triangle of the mesh."""
    vertices = target.faces[triangle]
    made = SnappedTriangle()
    made.a = target.fixed[vertices[0]]
    made.b = target.fixed[vertices[1]]
    made.c = target.fixed[vertices[2]]
    made.triangle = triangle
    return made


@wp.func
def edge_sum(tri: SnappedTriangle) -> wp.uint64:
    """A triangle's share of a sum over directed edges that changes its sign with an edge's direction.

    The sum over a mesh is 0 where every edge has its opposite. An edge's term is h = a b (b - a), of the hashes of its
    vertices; a triangle's share is this product.
    """
    a, b, c = wp.uint64(wp.uint32(tri.a[3])), wp.uint64(wp.uint32(tri.b[3])), wp.uint64(wp.uint32(tri.c[3]))
    return (a - b) * (b - c) * (c - a)


@wp.func
def volume_below(tri: SnappedTriangle) -> wp.float64:
    """Six times the signed volume between a triangle and the plane z = 0, cubic fixed-point texels.

    The sum over a closed mesh is six times the volume that it encloses, below 0 if its normals look in.
    """
    a, b, c = tri.a, tri.b, tri.c
    base = wp.int64(b[0] - a[0]) * wp.int64(c[1] - a[1]) - wp.int64(b[1] - a[1]) * wp.int64(c[0] - a[0])
    return wp.float64(base) * wp.float64(float(a[2]) + float(b[2]) + float(c[2]))


@wp.func
def lowest_corner(tri: SnappedTriangle) -> wp.vec3i:
    """The low corner of the box about a triangle, fixed-point texels."""
    a, b, c = tri.a, tri.b, tri.c
    return wp.vec3i(
        wp.min(a[0], wp.min(b[0], c[0])), wp.min(a[1], wp.min(b[1], c[1])), wp.min(a[2], wp.min(b[2], c[2]))
    )


@wp.func
def highest_corner(tri: SnappedTriangle) -> wp.vec3i:
    """The high corner of the box about a triangle, fixed-point texels."""
    a, b, c = tri.a, tri.b, tri.c
    return wp.vec3i(
        wp.max(a[0], wp.max(b[0], c[0])), wp.max(a[1], wp.max(b[1], c[1])), wp.max(a[2], wp.max(b[2], c[2]))
    )


@wp.func
def cell_of_middle(target: PatchTarget, tri: SnappedTriangle) -> int:
    """The cell of the survey that holds a triangle's middle."""
    third = target.cells_per_texel * TEXEL_OF_SUBTEXEL / 3.0
    a, b, c = tri.a, tri.b, tri.c
    x = cell_holding(third * (float(a[0]) + float(b[0]) + float(c[0])), target.cells[0])
    y = cell_holding(third * (float(a[1]) + float(b[1]) + float(c[1])), target.cells[1])
    z = cell_holding(third * (float(a[2]) + float(b[2]) + float(c[2])), target.cells[2])
    return cell_number(wp.vec3i(x, y, z), target.cells)


@wp.func
def holds_centre(low: int, high: int) -> int:
    """1 if a texel's centre lies from ``low`` to ``high``, else 0."""
    return wp.where(first_centre(low) <= last_centre(high), 1, 0)


@wp.func
def may_cover_centres(low: wp.vec3i, high: wp.vec3i) -> bool:
    """Whether a box holds texel centres along two axes: else it covers none in any map."""
    return holds_centre(low[0], high[0]) + holds_centre(low[1], high[1]) + holds_centre(low[2], high[2]) >= 2


@kernel
def survey_triangles(
    first: int,
    # In:
    target: PatchTarget,
    nothing: PatchList,  # patches are only counted
    # Out:
    out: SurveyResults,
):
    """A thread surveys one chunk of triangles."""
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    small = int(0)
    patches = int(0)
    patched = int(0)
    open_edges = wp.uint64(0)
    volume = wp.float64(0.0)
    for triangle in range(begin, wp.min(begin + CHUNK, target.faces.shape[0])):
        tri = snapped_triangle(target, triangle)
        open_edges += edge_sum(tri)
        volume += volume_below(tri)
        low, high = lowest_corner(tri), highest_corner(tri)
        if wp.max(high - low) > TOO_LARGE:
            out.cell[triangle] = NO_CELL
        else:
            small += 1
            out.cell[triangle] = cell_of_middle(target, tri)
            # Most triangles of a dense mesh lie between texel centres along two axes and end here.
            if may_cover_centres(low, high):
                given = lift_texels(target, tri, COUNT_ONLY, nothing)
                if given > 0:
                    out.patched_triangles[begin + patched] = tri
                    patched += 1
                    patches += given
    out.small[chunk] = small
    out.patches[chunk] = patches
    out.patched[chunk] = patched
    out.open_edges[chunk] = open_edges
    out.volume[chunk] = volume


@kernel
def make_patches(
    first: int,
    # In:
    target: PatchTarget,
    places: wp.array(dtype=wp.int32),
    patched: wp.array(dtype=wp.int32),
    patched_triangles: wp.array(dtype=SnappedTriangle),
    # Out:
    out: PatchList,
):
    """A thread makes the patches of one chunk of triangles."""
    chunk = first + wp.tid()
    place = int(places[chunk])
    for k in range(patched[chunk]):
        place += lift_texels(target, patched_triangles[CHUNK * chunk + k], place, out)


@kernel
def list_kept(
    first: int,
    # In:
    cell: wp.array(dtype=wp.int32),
    has_patch: wp.array(dtype=wp.uint8),
    near_doubtful: wp.array(dtype=wp.uint8),
    # Out, per chunk: triangles that no patch stands for, and their list
    count_out: wp.array(dtype=wp.int32),
    list_out: wp.array(dtype=wp.int32),
):
    """A thread lists the triangles of one chunk that stay in the tree."""
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    count = int(0)
    for triangle in range(begin, wp.min(begin + CHUNK, cell.shape[0])):
        is_kept = bool(cell[triangle] == NO_CELL)
        if not is_kept:
            is_kept = has_patch[cell[triangle]] == wp.uint8(0) or near_doubtful[cell[triangle]] != wp.uint8(0)
        if is_kept:
            list_out[begin + count] = triangle
            count += 1
    count_out[chunk] = count


class Survey:
    """The survey of a mesh's triangles in a box of texels."""

    def __init__(self, geometry: DeviceMesh, frame: TexelFrame, cells: int, facing_most: float) -> None:
        """Survey a mesh.

        Args:
            frame: the box of texels; a patch is a texel wide.
            cells: of the survey, along the longest side.
            facing_most: a map makes patches of what has this part of the largest of the three |n . axis| along its own
                axis.
        """
        self._device, self.triangles = geometry.vertices.device, len(geometry.faces)
        self.frame, self.cells_per_texel = frame, cells / max(frame.size)
        self.cells = wp.vec3i(*frame.cells(cells))
        """Along x, y and z."""
        target = PatchTarget()
        target.fixed, target.faces = snapped_vertices(geometry, frame), geometry.faces
        target.size, target.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
        target.facing_most = facing_most
        target.cells_per_texel, target.cells = self.cells_per_texel, self.cells
        self._target, self._found = target, self._results()
        nothing = PatchList()
        launch_chunks(survey_triangles, self.triangles, [target, nothing, self._found], self._device)
        self._places, self.count = exclusive_scan(self._found.patches)
        self.small = int(self._found.small.numpy().sum())
        """Triangles of at most two texels."""

    def _results(self) -> SurveyResults:
        """Room for what the survey finds; counts end with a 0 that a total may take the place of."""
        chunks, device = chunk_count(self.triangles), self._device
        found = SurveyResults()
        for name in ("small", "patches", "patched"):
            setattr(found, name, wp.zeros(chunks + 1, dtype=wp.int32, device=device))
        found.open_edges = wp.empty(chunks, dtype=wp.uint64, device=device)
        found.volume = wp.empty(chunks, dtype=wp.float64, device=device)
        found.patched_triangles = wp.empty(self.triangles, dtype=SnappedTriangle, device=device)
        found.cell = wp.empty(self.triangles, dtype=wp.int32, device=device)
        return found

    @functools.cached_property
    def front(self) -> int:
        """The sign of a triangle's side that looks out of a closed mesh: 1 if its normal does, -1 if it looks in; 0
        if the mesh is open, or wound one way here and the other there."""
        if self._found.open_edges.numpy().sum(dtype=np.uint64) != 0:
            return 0
        return int(np.sign(self._found.volume.numpy().sum()))

    def patches(self) -> tuple[wp.array, wp.array]:
        """(count,) ``Patch``, and (count,) int32, the texel of each, the three axes' maps in a row."""
        made = PatchList()
        made.patches = wp.empty(self.count, dtype=Patch, device=self._device)
        made.texel = wp.empty(self.count, dtype=wp.int32, device=self._device)
        inputs: list[Any] = [self._target, self._places, self._found.patched, self._found.patched_triangles, made]
        launch_chunks(make_patches, self.triangles, inputs, self._device)
        return made.patches, made.texel

    def kept_triangles(self, has_patch: wp.array, near_doubtful: wp.array) -> wp.array:
        """(n,) int32, the triangles that no patch stands for, in order.

        Those are large ones, and those in cells that no patch touches, such as wires between texel centres, or near
        doubtful ones.

        Args:
            has_patch: (cells,) uint8, 1 for cells that a patch touches.
            near_doubtful: (cells,) uint8, 1 for doubtful cells and their neighbours (``patch_check.py``).
        """
        counts = wp.zeros(chunk_count(self.triangles) + 1, dtype=wp.int32, device=self._device)
        listed = wp.empty(self.triangles, dtype=wp.int32, device=self._device)
        inputs = [self._found.cell, has_patch, near_doubtful, counts, listed]
        launch_chunks(list_kept, self.triangles, inputs, self._device)
        return gather_lists(listed, counts)
