"""Vertices of objects -> corners in pixels.

A large image is drawn in bands (``world/camera.py``). Corners are those of the whole image's pixels, so a band has the
image's bits. Corners that are not kept are computed again where they are needed: to the bit the same.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK
from ldtrefl.frame.pixel_box import BEHIND
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.unit_rays import unit_vertex

NEAREST = wp.constant(wp.float64(1.0e-300))
"""Depth from which 1 / depth is finite."""


@wp.struct
class DrawnObject:
    """An object that is drawn, and how its unit space is projected."""

    object: int  # its number
    first_corner: int  # place of its vertex 0 among the corners that are kept; -1 if its corners are not
    row_x: wp.vec4d  # pixels of the whole image from unit space: x depth, y depth, depth
    row_y: wp.vec4d
    row_z: wp.vec4d


@wp.func
def projected(drawn: DrawnObject, p: wp.vec3d) -> wp.vec3d:
    """A point of unit space as a corner: (x, y, 1 / depth) in pixels in front of the camera; elsewhere (x depth,
    y depth, depth)."""
    point = wp.vec4d(p[0], p[1], p[2], wp.float64(1.0))
    x, y, depth = wp.dot(drawn.row_x, point), wp.dot(drawn.row_y, point), wp.dot(drawn.row_z, point)
    corner = wp.vec3d(x, y, wp.min(depth, BEHIND))
    if depth > NEAREST:
        nearness = wp.float64(1.0) / depth
        corner = wp.vec3d(x * nearness, y * nearness, nearness)
    return corner


@wp.func
def corner_of(
    drawn: DrawnObject, objects: wp.array(dtype=ObjectRecord), corners: wp.array(dtype=wp.vec3d), vertex: int
) -> wp.vec3d:
    """A vertex of an object that is drawn as a corner: that which is kept, or else found again."""
    if drawn.first_corner >= 0:
        return corners[drawn.first_corner + vertex]
    return projected(drawn, unit_vertex(objects[drawn.object], vertex))


@wp.func
def homogeneous(corner: wp.vec3d) -> wp.vec3d:
    """(x depth, y depth, depth) of a corner."""
    if corner[2] > BEHIND:
        depth = wp.float64(1.0) / corner[2]
        return wp.vec3d(corner[0] * depth, corner[1] * depth, depth)
    return corner


@launch.kernel
def project_vertices(
    first: int,
    # In:
    chunks: wp.array(dtype=wp.vec2i),  # ``chunks_of`` vertices
    objects: wp.array(dtype=ObjectRecord),
    drawn: wp.array(dtype=DrawnObject),
    # Out:
    corners_out: wp.array(dtype=wp.vec3d),
):
    """Project the vertices of one chunk."""
    chunk = first + wp.tid()
    one = drawn[chunks[chunk][0]]
    vertices = objects[one.object].vertices
    has_outliers = objects[one.object].exact_vertices.shape[0] > 0
    i = int(chunks[chunk][1])
    end = wp.min(i + CHUNK, vertices.shape[0])
    while i < end:
        p = wp.vec3d(wp.float64(vertices[i][0]), wp.float64(vertices[i][1]), wp.float64(vertices[i][2]))
        if has_outliers:
            p = objects[one.object].exact_vertices[i]
        corners_out[one.first_corner + i] = projected(one, p)
        i += 1


def chunks_of(counts: np.ndarray, device: wp.Device) -> wp.array:
    """(chunks,) vec2i: the vertices or triangles of objects that have so many each, up to ``CHUNK`` of one object in
    each. The place of the object among these, and the chunk's first vertex or triangle in it."""
    chunks = -(-counts // int(CHUNK))
    place = np.repeat(np.arange(len(counts)), chunks)
    begin = int(CHUNK) * (np.arange(len(place)) - np.repeat(np.cumsum(chunks) - chunks, chunks))
    return wp.array(np.stack([place, begin], axis=1).astype(np.int32), dtype=wp.vec2i, device=device)
