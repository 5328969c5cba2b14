"""Mesh -> fragments of a layered depth texture, in one pass over the geometry.

Depth peeling (Zhang, Hsieh and Shen, section 3.4) draws the object once per layer. An A-buffer gives the same
fragments in one pass: every triangle is rasterised exactly along the three axes (``raster.py``), all its fragments are
kept, put into their texels and sorted by depth. Any number of layers; memory follows the fragments.

    snap vertices -> count fragments, by runs of triangles -> prefix sum -> fill -> into texels -> sort each texel

Every step writes places of its own, and fragments are sorted by (depth, triangle), so the bits are the same for any
number of threads.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.base.budget import take
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.bins import bin_items, exclusive_scan
from ldtrefl.geometry.fixed_raster import FixedTriangle, cover, fixed_triangle, interpolate, snap, unsnap
from ldtrefl.ldt.linear.occupancy import Occupancy, occupancy_of
from ldtrefl.ldt.texel_frame import TexelFrame
from ldtrefl.world.device_mesh import DeviceMesh

INSERTION_LIMIT = wp.constant(24)
"""Fragments in a texel up to which insertion sort beats heap sort."""

RUNS = 8192
"""Runs of triangles, at most, whose fragments are counted together: threads can share so many, and their sums take no
time."""

BYTES_PER_FRAGMENT = 25
"""What a fragment takes in the maps, and while they are made."""


@wp.struct
class PeelTarget:
    """The mesh in the box of texels that it is peeled into."""

    fixed: wp.array(dtype=wp.vec4i)  # vertices in fixed-point texels, and a hash of their place
    faces: wp.array(dtype=wp.vec3i)
    size: wp.vec3i
    first_texel: wp.vec3i


MIX_X = wp.constant(wp.uint32(0x9E3779B1))
MIX_Y = wp.constant(wp.uint32(0x85EBCA77))
"""Odd multipliers of a hash (xxHash's primes). A literal in a kernel would be an int32, which these do not fit."""


@wp.func
def place_hash(x: int, y: int, z: int) -> int:
    """32 well-mixed bits that are the same for vertices in one place."""
    h = wp.uint32(x) * MIX_X + wp.uint32(y) * MIX_Y + wp.uint32(z)
    h = (h ^ (h >> wp.uint32(15))) * wp.uint32(0x2C1B3C6D)
    h = (h ^ (h >> wp.uint32(12))) * wp.uint32(0x297A2D39)
    return int(h ^ (h >> wp.uint32(15)))


@launch.kernel
def snap_vertices(
    first: int,
    # In:
    vertices: wp.array(dtype=wp.vec3),
    scale: float,
    offset: wp.vec3,
    # Out:
    fixed_out: wp.array(dtype=wp.vec4i),
):
    i = first + wp.tid()
    p = scale * vertices[i] + offset
    x, y, z = int(snap(p[0])), int(snap(p[1])), int(snap(p[2]))
    fixed_out[i] = wp.vec4i(x, y, z, place_hash(x, y, z))


@wp.func
def projected(target: PeelTarget, a: wp.vec4i, b: wp.vec4i, c: wp.vec4i, axis: int) -> FixedTriangle:
    """A triangle in the map of ``axis``."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    return fixed_triangle(a[u], a[v], b[u], b[v], c[u], c[v], target.size[u], target.size[v])


@launch.kernel
def count_fragments(
    first: int,
    # In:
    target: PeelTarget,
    length: int,  # triangles in a run
    # Out, per run: fragments; triangles that give some, and their list
    counts_out: wp.array(dtype=wp.int64),
    givers_out: wp.array(dtype=wp.int32),
    giver_out: wp.array(dtype=wp.int32),
):
    run = first + wp.tid()
    begin = length * run
    total = wp.int64(0)
    givers = int(0)
    for triangle in range(begin, wp.min(begin + length, target.faces.shape[0])):
        corners = target.faces[triangle]
        a, b, c = target.fixed[corners[0]], target.fixed[corners[1]], target.fixed[corners[2]]
        count = int(0)
        for axis in range(3):
            tri = projected(target, a, b, c, axis)
            if tri.area != wp.int64(0):
                for v in range(tri.first_v, tri.last_v + 1):
                    for u in range(tri.first_u, tri.last_u + 1):
                        if cover(tri, u, v).covered:
                            count += 1
        if count > 0:
            total += wp.int64(count)
            giver_out[begin + givers] = triangle
            givers += 1
    counts_out[run] = total
    givers_out[run] = givers


@launch.kernel
def fill_fragments(
    first: int,
    # In:
    target: PeelTarget,
    length: int,
    places: wp.array(dtype=wp.int64),
    givers: wp.array(dtype=wp.int32),
    giver: wp.array(dtype=wp.int32),
    # Out:
    texel_out: wp.array(dtype=wp.int32),
    depth_out: wp.array(dtype=wp.float32),
    reference_out: wp.array(dtype=wp.int32),
):
    run = first + wp.tid()
    place = int(places[run])
    for k in range(givers[run]):
        triangle = giver[length * run + k]
        corners = target.faces[triangle]
        a, b, c = target.fixed[corners[0]], target.fixed[corners[1]], target.fixed[corners[2]]
        for axis in range(3):
            tri = projected(target, a, b, c, axis)
            if tri.area != wp.int64(0):
                columns = target.size[(axis + 1) % 3]
                for v in range(tri.first_v, tri.last_v + 1):
                    for u in range(tri.first_u, tri.last_u + 1):
                        at = cover(tri, u, v)
                        if at.covered:
                            texel_out[place] = target.first_texel[axis] + v * columns + u
                            depth_out[place] = interpolate(tri, at, unsnap(a[axis]), unsnap(b[axis]), unsnap(c[axis]))
                            # Counter-clockwise in (u, v) is a normal up the axis.
                            reference_out[place] = 2 * triangle + 1 - tri.flipped
                            place += 1


@launch.kernel
def scatter_fragments(
    first: int,
    # In:
    texel: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    depth: wp.array(dtype=wp.float32),
    reference: wp.array(dtype=wp.int32),
    # Out:
    depth_out: wp.array(dtype=wp.float32),
    reference_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    place = start[texel[i]] + ranks[i]
    depth_out[place] = depth[i]
    reference_out[place] = reference[i]


@wp.func
def comes_before(depth_a: float, reference_a: int, depth_b: float, reference_b: int) -> bool:
    """The order in a texel: by depth, equal depths by triangle."""
    return depth_a < depth_b or (depth_a == depth_b and reference_a < reference_b)


@wp.func
def insertion_sort(depth: wp.array(dtype=wp.float32), reference: wp.array(dtype=wp.int32), first: int, end: int):
    """Sort a short run."""
    for i in range(first + 1, end):
        d = depth[i]
        r = reference[i]
        j = int(i)
        while j > first and comes_before(d, r, depth[j - 1], reference[j - 1]):
            depth[j] = depth[j - 1]
            reference[j] = reference[j - 1]
            j -= 1
        depth[j] = d
        reference[j] = r


@wp.func
def sift_down(
    depth: wp.array(dtype=wp.float32), reference: wp.array(dtype=wp.int32), first: int, root: int, count: int
):
    """Restore the heap below ``root``."""
    d = depth[first + root]
    r = reference[first + root]
    parent = int(root)
    child = 2 * parent + 1
    while child < count:
        if child + 1 < count and comes_before(
            depth[first + child], reference[first + child], depth[first + child + 1], reference[first + child + 1]
        ):
            child += 1
        if not comes_before(d, r, depth[first + child], reference[first + child]):
            break
        depth[first + parent] = depth[first + child]
        reference[first + parent] = reference[first + child]
        parent = child
        child = 2 * parent + 1
    depth[first + parent] = d
    reference[first + parent] = r


@wp.func
def heap_sort(depth: wp.array(dtype=wp.float32), reference: wp.array(dtype=wp.int32), first: int, end: int):
    """Sort a long run: a texel may hold a whole mesh."""
    count = end - first
    root = count / 2 - 1
    while root >= 0:
        sift_down(depth, reference, first, root, count)
        root -= 1
    last = count - 1
    while last > 0:
        d = depth[first]
        r = reference[first]
        depth[first] = depth[first + last]
        reference[first] = reference[first + last]
        depth[first + last] = d
        reference[first + last] = r
        sift_down(depth, reference, first, 0, last)
        last -= 1


@launch.kernel
def sort_texels(
    first: int,
    # In:
    start: wp.array(dtype=wp.int32),
    # In and out:
    depth: wp.array(dtype=wp.float32),
    reference: wp.array(dtype=wp.int32),
):
    texel = first + wp.tid()
    begin, end = start[texel], start[texel + 1]
    if end - begin > INSERTION_LIMIT:
        heap_sort(depth, reference, begin, end)
    elif end - begin > 1:
        insertion_sort(depth, reference, begin, end)


@dataclass(frozen=True, eq=False)
class Fragments:
    """Fragments of the three maps, as arrays of equal length."""

    texel: wp.array
    """int32 number of the texel, the three axes' maps in a row."""
    depth: wp.array
    """float32, texels along the map's axis."""
    reference: wp.array
    """int32: triangle times 2, plus 1 if it faces up the axis."""


def snapped_vertices(geometry: DeviceMesh, frame: TexelFrame) -> wp.array:
    """(vertices,) vec4i: x, y, z in fixed-point texels, and a hash of them."""
    device, count = geometry.vertices.device, len(geometry.vertices)
    fixed = wp.empty(count, dtype=wp.vec4i, device=device)
    inputs: list[Any] = [geometry.vertices, frame.scale, wp.vec3(*frame.offset)]
    launch.launch(snap_vertices, count, [*inputs, fixed], device)
    return fixed


class Rasteriser:
    """A mesh in its box of texels: counts its fragments, then makes them."""

    def __init__(self, geometry: DeviceMesh, frame: TexelFrame) -> None:
        self._device = geometry.vertices.device
        self._triangles = len(geometry.faces)
        self._target = PeelTarget()
        self._target.fixed = snapped_vertices(geometry, frame)
        self._target.faces = geometry.faces
        self._target.size, self._target.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
        self._length = -(-self._triangles // RUNS)
        self._runs = -(-self._triangles // self._length)
        counts = wp.zeros(self._runs + 1, dtype=wp.int64, device=self._device)
        self._givers = wp.empty(self._runs, dtype=wp.int32, device=self._device)
        self._giver = wp.empty(self._triangles, dtype=wp.int32, device=self._device)
        outputs = [counts, self._givers, self._giver]
        launch.launch(count_fragments, self._runs, [self._target, self._length, *outputs], self._device)
        self._places, self.count = exclusive_scan(counts)
        if self.count > np.iinfo(np.int32).max:
            raise InputError(f"{self.count} fragments at resolution {max(frame.size)}; a lower resolution is needed")
        take(BYTES_PER_FRAGMENT * self.count, f"{self.count} fragments at resolution {max(frame.size)}", "resolution")

    def fragments(self) -> Fragments:
        """All fragments, by triangle."""
        texel, reference = (wp.empty(self.count, dtype=wp.int32, device=self._device) for _ in range(2))
        depth = wp.empty(self.count, dtype=wp.float32, device=self._device)
        inputs = [self._target, self._length, self._places, self._givers, self._giver]
        launch.launch(fill_fragments, self._runs, [*inputs, texel, depth, reference], self._device)
        return Fragments(texel, depth, reference)


@dataclass(frozen=True, eq=False)
class Maps:
    """The fragments in their texels, each texel sorted; see ``fragments.py``."""

    start: wp.array
    depth: wp.array
    reference: wp.array
    occupancy: Occupancy
    """Derived from the others."""

    def packed(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """(arrays, nothing else) that :meth:`unpacked` makes the same maps from."""
        return {name: getattr(self, name).numpy() for name in ("start", "depth", "reference")}, {}

    @classmethod
    def unpacked(cls, frame: TexelFrame, arrays: dict[str, np.ndarray], device: wp.Device) -> Maps:
        """Maps from what :meth:`packed` gave; on the CPU they share the arrays' memory.

        What comes from a file is checked first: :func:`check_fragments`, :func:`check_order`.
        """
        dtypes = {"start": wp.int32, "depth": wp.float32, "reference": wp.int32}
        start, depth, reference = (
            wp.array(arrays[name], dtype=dtype, device=device, copy=False) for name, dtype in dtypes.items()
        )
        return cls(start, depth, reference, occupancy_of(frame, start, depth, reference))

    @property
    def nbytes(self) -> int:
        """Bytes of the maps and what they imply."""
        return 4 * (self.start.size + self.depth.size + self.reference.size) + self.occupancy.nbytes


def sort_fragments(frame: TexelFrame, raw: Fragments) -> Maps:
    """Put fragments into their texels and sort each texel."""
    texels, total, device = frame.first_texels[3], raw.texel.shape[0], raw.texel.device
    start, ranks = bin_items(raw.texel, texels, device)
    depth, reference = wp.empty_like(raw.depth), wp.empty_like(raw.reference)
    launch.launch(
        scatter_fragments, total, [raw.texel, start, ranks, raw.depth, raw.reference, depth, reference], device
    )
    return sorted_maps(frame, start, depth, reference)


def sorted_maps(frame: TexelFrame, start: wp.array, depth: wp.array, reference: wp.array) -> Maps:
    """Sort the fragments of each texel in place."""
    launch.launch(sort_texels, start.shape[0] - 1, [start, depth, reference], start.device)
    return Maps(start, depth, reference, occupancy_of(frame, start, depth, reference))


def check_fragments(frame: TexelFrame, triangles: int, arrays: dict[str, np.ndarray]) -> None:
    """Check maps that come from a file, for a mesh of so many triangles, before a kernel reads what they point to.

    Raises:
        ValueError, KeyError: they are not sound; the message says what.
    """
    start, depth, reference = (arrays[name] for name in ("start", "depth", "reference"))
    for array, dtype in ((start, np.int32), (depth, np.float32), (reference, np.int32)):
        if array.dtype != dtype or array.ndim != 1:
            raise ValueError("arrays of another type")
    if start.shape != (frame.first_texels[3] + 1,) or start[0] != 0 or not (start[1:] >= start[:-1]).all():
        raise ValueError("texels that do not follow each other")
    if not depth.shape == reference.shape == (int(start[-1]),):
        raise ValueError("fragments for other texels")
    if not (np.isfinite(depth).all() and (reference >= 0).all() and (reference >> 1 < triangles).all()):
        raise ValueError("a depth or a triangle that the mesh does not have")


def check_order(arrays: dict[str, np.ndarray]) -> None:
    """Check that the fragments of each texel are sorted, after the rest.

    Raises:
        ValueError, KeyError: they are not.
    """
    start, depth = arrays["start"], arrays["depth"]
    falls = np.flatnonzero(depth[1:] < depth[:-1]) + 1
    if not np.isin(falls, start).all():
        raise ValueError("fragments out of order")
