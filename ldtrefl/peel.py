"""Mesh -> layered depth texture, in one pass over the geometry.

Depth peeling (Zhang, Hsieh and Shen, section 3.4) draws the object once per layer. An A-buffer gives the same
fragments in one pass: every triangle is rasterised exactly along the three axes (``raster.py``), all its fragments are
kept, put into their texels and sorted by depth. Any number of layers; memory follows the fragments.

    count a triangle's fragments -> prefix sum -> fill -> count a texel's fragments -> prefix sum -> place -> sort

Every step writes places of its own, and fragments are sorted by (depth, triangle), so the bits are the same for any
number of threads.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import warp as wp
from pydantic import Field, TypeAdapter, ValidationError

from ldtrefl import launch
from ldtrefl.cubemap import TexelFrame, texel_from_point
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.errors import InputError, first_fault
from ldtrefl.ldt import LayeredDepthTexture
from ldtrefl.mesh import Mesh
from ldtrefl.raster import FixedTriangle, cover, fixed_triangle, interpolate

Resolution = Annotated[int, Field(strict=True, ge=1, le=4096)]
"""Texels along an object's longest side."""

DEFAULT_RESOLUTION = 256
INSERTION_LIMIT = wp.constant(24)
"""Fragments in a texel up to which insertion sort beats heap sort."""


@wp.struct
class PeelTarget:
    """The mesh and the box of texels that it is peeled into."""

    vertices: wp.array(dtype=wp.vec3)
    faces: wp.array(dtype=wp.vec3i)
    scale: float  # texel = scale * unit + offset
    offset: wp.vec3
    size: wp.vec3i
    first_texel: wp.vec3i


@wp.func
def corner_texel(target: PeelTarget, vertex: int, axis: int) -> wp.vec3:
    """(u, v, depth) of a vertex in the map of ``axis``."""
    return texel_from_point(axis, target.scale * target.vertices[vertex] + target.offset)


@wp.func
def projected(target: PeelTarget, corners: wp.vec3i, axis: int) -> FixedTriangle:
    """A triangle in the map of ``axis``."""
    a, b, c = (
        corner_texel(target, corners[0], axis),
        corner_texel(target, corners[1], axis),
        corner_texel(target, corners[2], axis),
    )
    columns, rows = target.size[(axis + 1) % 3], target.size[(axis + 2) % 3]
    return fixed_triangle(wp.vec2(a[0], a[1]), wp.vec2(b[0], b[1]), wp.vec2(c[0], c[1]), columns, rows)


@launch.kernel
def count_fragments(
    first: int,
    # In:
    target: PeelTarget,
    # Out:
    counts_out: wp.array(dtype=wp.int32),
):
    triangle = first + wp.tid()
    count = int(0)
    for axis in range(3):
        tri = projected(target, target.faces[triangle], axis)
        if tri.area != wp.int64(0):
            for v in range(tri.first_v, tri.last_v + 1):
                for u in range(tri.first_u, tri.last_u + 1):
                    if cover(tri, u, v).covered:
                        count += 1
    counts_out[triangle] = count


@launch.kernel
def fill_fragments(
    first: int,
    # In:
    target: PeelTarget,
    places: wp.array(dtype=wp.int32),
    # Out:
    texel_out: wp.array(dtype=wp.int32),
    depth_out: wp.array(dtype=wp.float32),
    reference_out: wp.array(dtype=wp.int32),
):
    triangle = first + wp.tid()
    place = places[triangle]
    if place == places[triangle + 1]:
        return
    corners = target.faces[triangle]
    for axis in range(3):
        tri = projected(target, corners, axis)
        if tri.area != wp.int64(0):
            a, b, c = (
                corner_texel(target, corners[0], axis),
                corner_texel(target, corners[1], axis),
                corner_texel(target, corners[2], axis),
            )
            columns = target.size[(axis + 1) % 3]
            for v in range(tri.first_v, tri.last_v + 1):
                for u in range(tri.first_u, tri.last_u + 1):
                    at = cover(tri, u, v)
                    if at.covered:
                        texel_out[place] = target.first_texel[axis] + v * columns + u
                        depth_out[place] = interpolate(tri, at, a[2], b[2], c[2])
                        # Counter-clockwise in (u, v) is a normal up the axis.
                        reference_out[place] = 2 * triangle + 1 - tri.flipped
                        place += 1


@wp.func
def texel_is_in_part(texel: int, texels: int, part: int, parts: int) -> bool:
    """Whether a texel belongs to one of ``parts`` equal runs of the texels."""
    return int(wp.int64(texel) * wp.int64(parts) / wp.int64(texels)) == part


@launch.kernel
def count_texels(
    part: int,
    parts: int,
    # In:
    texel: wp.array(dtype=wp.int32),
    texels: int,
    # Out:
    counts_out: wp.array(dtype=wp.int32),
):
    i = wp.tid()
    if texel_is_in_part(texel[i], texels, part, parts):
        wp.atomic_add(counts_out, texel[i], 1)


@launch.kernel
def place_fragments(
    part: int,
    parts: int,
    # In:
    texel: wp.array(dtype=wp.int32),
    depth: wp.array(dtype=wp.float32),
    reference: wp.array(dtype=wp.int32),
    texels: int,
    start: wp.array(dtype=wp.int32),
    # Out:
    filled_out: wp.array(dtype=wp.int32),
    depth_out: wp.array(dtype=wp.float32),
    reference_out: wp.array(dtype=wp.int32),
):
    i = wp.tid()
    if texel_is_in_part(texel[i], texels, part, parts):
        place = start[texel[i]] + wp.atomic_add(filled_out, texel[i], 1)
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


def peel(
    vertices: Any, faces: Any, resolution: int = DEFAULT_RESOLUTION, device: str | None = None
) -> LayeredDepthTexture:
    """Peel a triangle mesh into a layered depth texture.

    Args:
        vertices: (n, 3) numbers, object space.
        faces: (m, 3) vertex numbers.
        resolution: texels along the longest side of the bounding box, 1 to 4096.
        device: 'cpu' (default) or a CUDA device.

    Raises:
        InputError: an empty mesh, an index out of range, a vertex that is not finite, a resolution not allowed.
    """
    return peel_mesh(DeviceMesh.upload(Mesh(vertices, faces), launch.resolve_device(device)), resolution)


def peel_mesh(geometry: DeviceMesh, resolution: int = DEFAULT_RESOLUTION) -> LayeredDepthTexture:
    """:func:`peel` for a mesh that is on a device already."""
    try:
        TypeAdapter(Resolution).validate_python(resolution)
    except ValidationError as error:
        raise first_fault(error, {}).within("resolution") from None
    device = geometry.vertices.device
    low, high = _unit_bounds(geometry.mesh)
    frame = TexelFrame.around(low, high, resolution)
    raw = _rasterise(geometry, frame, device)
    return LayeredDepthTexture(geometry, frame, *_sorted(frame, *raw, device))


def _unit_bounds(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    centre, half = mesh.unit_frame
    low, high = mesh.bounds
    return (low - centre) / half, (high - centre) / half


def _rasterise(geometry: DeviceMesh, frame: TexelFrame, device: wp.Device) -> tuple[wp.array, wp.array, wp.array]:
    """(texel, depth, reference) of every fragment, by triangle."""
    triangles = geometry.faces.shape[0]
    target = PeelTarget()
    target.vertices, target.faces = geometry.vertices, geometry.faces
    target.scale, target.offset = frame.scale, wp.vec3(*frame.offset)
    target.size, target.first_texel = wp.vec3i(*frame.size), wp.vec3i(*frame.first_texels[:3])
    counts = wp.zeros(triangles + 1, dtype=wp.int32, device=device)
    launch.launch(count_fragments, triangles, [target, counts], device)
    total = int(counts.numpy().sum(dtype=np.int64))
    if total > np.iinfo(np.int32).max:
        raise InputError(f"{total} fragments at resolution {max(frame.size)}; a lower resolution is needed")
    places = wp.empty(triangles + 1, dtype=wp.int32, device=device)
    wp.utils.array_scan(counts, places, inclusive=False)
    texel, reference = (wp.empty(total, dtype=wp.int32, device=device) for _ in range(2))
    depth = wp.empty(total, dtype=wp.float32, device=device)
    launch.launch(fill_fragments, triangles, [target, places, texel, depth, reference], device)
    return texel, depth, reference


def _sorted(
    frame: TexelFrame, texel: wp.array, depth: wp.array, reference: wp.array, device: wp.Device
) -> tuple[wp.array, wp.array, wp.array]:
    """(start, depth, reference) with the fragments in their texels."""
    texels, total = frame.first_texels[3], texel.shape[0]
    counts = wp.zeros(texels + 1, dtype=wp.int32, device=device)
    launch.launch_parts(count_texels, total, [texel, texels, counts], device)
    start = wp.empty(texels + 1, dtype=wp.int32, device=device)
    wp.utils.array_scan(counts, start, inclusive=False)
    counts.zero_()
    depth_out, reference_out = wp.empty_like(depth), wp.empty_like(reference)
    inputs = [texel, depth, reference, texels, start, counts, depth_out, reference_out]
    launch.launch_parts(place_fragments, total, inputs, device)
    launch.launch(sort_texels, texels, [start, depth_out, reference_out], device)
    return start, depth_out, reference_out
