"""Mesh -> the fragments of a layered depth texture, in one pass over the geometry.

Depth peeling (Zhang, Hsieh and Shen, section 3.4) draws the object once per layer. An A-buffer gives the same
fragments in one pass: every triangle is rasterised exactly along the three axes (``geometry/fixed_raster.py``), and all
its fragments are kept. Any number of layers; memory follows the fragments.

    snap vertices -> count fragments, by runs of triangles -> prefix sum -> fill

Every step writes places of its own, so the bits are the same for any number of threads.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.base.budget import take
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.device.bins import exclusive_scan
from ldtrefl.geometry.fixed_raster import FixedTriangle, cover, fixed_triangle, interpolate, snap, unsnap
from ldtrefl.ldt.texel_frame import TexelFrame
from ldtrefl.world.device_mesh import DeviceMesh

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
    size: wp.vec3i  # texels along x, y and z
    first_texel: wp.vec3i  # of each axis' map
    run_length: int  # triangles in a run


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
    """A thread snaps one vertex to fixed-point texels."""
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
    # Out, per run: fragments; triangles that give some, and their list
    counts_out: wp.array(dtype=wp.int64),
    covering_count_out: wp.array(dtype=wp.int32),
    covering_out: wp.array(dtype=wp.int32),
):
    """A thread counts the fragments of one run of triangles, and lists those that give some."""
    run = first + wp.tid()
    begin = target.run_length * run
    total = wp.int64(0)
    covering = int(0)
    for triangle in range(begin, wp.min(begin + target.run_length, target.faces.shape[0])):
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
            covering_out[begin + covering] = triangle
            covering += 1
    counts_out[run] = total
    covering_count_out[run] = covering


@launch.kernel
def fill_fragments(
    first: int,
    # In:
    target: PeelTarget,
    places: wp.array(dtype=wp.int64),
    covering_count: wp.array(dtype=wp.int32),
    covering: wp.array(dtype=wp.int32),
    # Out:
    texel_out: wp.array(dtype=wp.int32),
    depth_out: wp.array(dtype=wp.float32),
    reference_out: wp.array(dtype=wp.int32),
):
    """A thread makes the fragments of one run of triangles."""
    run = first + wp.tid()
    place = int(places[run])
    for k in range(covering_count[run]):
        triangle = covering[target.run_length * run + k]
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
        """Count the fragments of a mesh.

        Raises:
            InputError: there are more than can be numbered, or than memory allows.
        """
        self._device, triangles = geometry.vertices.device, len(geometry.faces)
        target = PeelTarget()
        target.fixed, target.faces = snapped_vertices(geometry, frame), geometry.faces
        target.size, target.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
        target.run_length = -(-triangles // RUNS)
        self._target, self._runs = target, -(-triangles // target.run_length)
        counts = wp.zeros(self._runs + 1, dtype=wp.int64, device=self._device)
        self._covering_count = wp.empty(self._runs, dtype=wp.int32, device=self._device)
        self._covering = wp.empty(triangles, dtype=wp.int32, device=self._device)
        outputs = [counts, self._covering_count, self._covering]
        launch.launch(count_fragments, self._runs, [target, *outputs], self._device)
        self._places, self.count = exclusive_scan(counts)
        if self.count > np.iinfo(np.int32).max:
            raise InputError(f"{self.count} fragments at resolution {max(frame.size)}; a lower resolution is needed")
        take(BYTES_PER_FRAGMENT * self.count, f"{self.count} fragments at resolution {max(frame.size)}", "resolution")

    def fragments(self) -> Fragments:
        """All fragments, by triangle."""
        texel, reference = (wp.empty(self.count, dtype=wp.int32, device=self._device) for _ in range(2))
        depth = wp.empty(self.count, dtype=wp.float32, device=self._device)
        inputs = [self._target, self._places, self._covering_count, self._covering]
        launch.launch(fill_fragments, self._runs, [*inputs, texel, depth, reference], self._device)
        return Fragments(texel, depth, reference)
