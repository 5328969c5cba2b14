"""Triangle -> patches: texels lifted to the plane of a triangle that covers their centres.

A *patch* is a fragment of the maps (``fragments.py``) as part of its triangle's plane, one texel wide, made in the maps
whose axis it faces.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.fixed_raster import FixedTriangle, cover, fixed_triangle, interpolate, unsnap
from ldtrefl.ldt.exact.patch import LARGE, Patch
from ldtrefl.ldt.texel_frame import point_from_texel

FACING = wp.constant(0.55)
"""|n . axis| from which a map makes a patch of a fragment: every direction faces one of the three with 0.577 or more.
At 0.577 itself, where two maps meet on a bent surface, twice as many rays slipped between their patches."""
PATCH_MARGIN = wp.constant(0.08)
"""Part of a patch's side added around it, so that neighbours on a bent surface overlap instead of leaving a slit. With
0.02 one ray in a thousand slipped through to the far wall, specks in the picture; with 0.06 one in ten thousand, at a
fifth more wrong hits along silhouettes."""
COUNT_ONLY = wp.constant(-1)
"""In place of where patches go: they are only counted."""


@wp.struct
class PatchTarget:
    """The mesh in the box of texels that its patches are made in, and the cells of the survey over them."""

    fixed: wp.array(dtype=wp.vec4i)  # vertices in fixed-point texels, and a hash of their place
    faces: wp.array(dtype=wp.vec3i)
    size: wp.vec3i  # texels
    first_texel: wp.vec3i  # of each axis' map
    facing_most: float  # |n . axis| over the largest of the three from which a map makes a patch of a fragment
    cells_per_texel: float
    cells: wp.vec3i  # along x, y and z


@wp.struct
class SnappedTriangle:
    """A triangle of the mesh by its corners."""

    a: wp.vec4i  # fixed-point texels, and the hash of their place
    b: wp.vec4i
    c: wp.vec4i
    triangle: int


@wp.struct
class PatchList:
    """Patches, and where they lie."""

    patches: wp.array(dtype=Patch)
    texel: wp.array(dtype=wp.int32)  # of each patch, the three axes' maps in a row


@wp.func
def fixed_normal(tri: SnappedTriangle) -> wp.vec3:
    """Unit normal of a triangle; 0 for one without area."""
    a, b, c = tri.a, tri.b, tri.c
    u = wp.vec3(float(b[0] - a[0]), float(b[1] - a[1]), float(b[2] - a[2]))
    v = wp.vec3(float(c[0] - a[0]), float(c[1] - a[1]), float(c[2] - a[2]))
    return wp.normalize(wp.cross(u, v))


@wp.func
def faces_map(normal: wp.vec3, axis: int, facing_most: float) -> bool:
    """Whether the map of ``axis`` makes patches of fragments with this unit normal."""
    across = wp.max(wp.abs(normal[(axis + 1) % 3]), wp.abs(normal[(axis + 2) % 3]))
    return wp.abs(normal[axis]) >= wp.max(FACING, facing_most * across)


@wp.func
def facing_triangle(target: PatchTarget, axis: int, tri: SnappedTriangle, normal: wp.vec3) -> FixedTriangle:
    """A triangle in the map of ``axis``; area 0 if the map does not face it."""
    if not faces_map(normal, axis, target.facing_most):
        return FixedTriangle()
    a, b, c = tri.a, tri.b, tri.c
    u, v = (axis + 1) % 3, (axis + 2) % 3
    return fixed_triangle(a[u], a[v], b[u], b[v], c[u], c[v], target.size[u], target.size[v])


@wp.func
def is_larger_than_texel(tri: SnappedTriangle) -> bool:
    """Whether the box about a triangle is wider than a texel along any axis."""
    is_larger = bool(False)
    for i in range(3):
        width = wp.max(tri.a[i], wp.max(tri.b[i], tri.c[i])) - wp.min(tri.a[i], wp.min(tri.b[i], tri.c[i]))
        if unsnap(width) > 1.0:
            is_larger = True
    return is_larger


@wp.func
def patch_of(
    target: PatchTarget, tri: SnappedTriangle, axis: int, u: int, v: int, depth: float, normal: wp.vec3
) -> Patch:
    """The plane of a triangle over a texel of the map of ``axis``, a little wider than the texel."""
    slope_u, slope_v = -normal[(axis + 1) % 3] / normal[axis], -normal[(axis + 2) % 3] / normal[axis]
    half = 0.5 + PATCH_MARGIN
    corner = wp.vec3(float(u) - PATCH_MARGIN, float(v) - PATCH_MARGIN, depth - half * (slope_u + slope_v))
    along_u = 2.0 * half * target.cells_per_texel * point_from_texel(axis, wp.vec3(1.0, 0.0, slope_u))
    along_v = 2.0 * half * target.cells_per_texel * point_from_texel(axis, wp.vec3(0.0, 1.0, slope_v))
    patch = Patch()
    patch.corner = target.cells_per_texel * point_from_texel(axis, corner)
    # In this order of the edges the patch has the triangle's normal.
    patch.edge_u = wp.where(normal[axis] < 0.0, along_v, along_u)
    patch.edge_v = wp.where(normal[axis] < 0.0, along_u, along_v)
    patch.kind = wp.where(is_larger_than_texel(tri), axis + LARGE, axis)
    patch.triangle = tri.triangle
    return patch


@wp.func
def lift_texels(target: PatchTarget, tri: SnappedTriangle, place: int, out: PatchList) -> int:
    """Make patches of the texels whose centres a triangle covers in the maps that face it, from ``place`` on.

    Returns how many there are. If ``place`` is COUNT_ONLY, none is made.
    """
    normal = fixed_normal(tri)
    count = int(0)
    for axis in range(3):
        flat = facing_triangle(target, axis, tri, normal)
        if flat.area != wp.int64(0):
            for v in range(flat.first_v, flat.last_v + 1):
                for u in range(flat.first_u, flat.last_u + 1):
                    at = cover(flat, u, v)
                    if at.covered:
                        if place != COUNT_ONLY:
                            depth = interpolate(flat, at, unsnap(tri.a[axis]), unsnap(tri.b[axis]), unsnap(tri.c[axis]))
                            out.patches[place + count] = patch_of(target, tri, axis, u, v, depth, normal)
                            out.texel[place + count] = target.first_texel[axis] + v * target.size[(axis + 1) % 3] + u
                        count += 1
    return count
