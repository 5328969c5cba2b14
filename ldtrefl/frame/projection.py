"""Vertices of objects -> corners in pixels.

A large image is drawn in bands (``world/camera.py``). Corners are those of the whole image's pixels, so a band has the
image's bits.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK
from ldtrefl.world.records import ObjectRecord

BEHIND = wp.constant(wp.float64(0.0))
"""Depth up to which a point is not in front of the camera."""

NEAREST = wp.constant(wp.float64(1.0e-300))
"""Depth from which 1 / depth is finite."""


@wp.struct
class Chunks:
    """Vertices or triangles of the objects that are drawn, up to ``CHUNK`` of one object in each."""

    place: wp.array(dtype=wp.int32)  # of the object among those drawn
    object: wp.array(dtype=wp.int32)
    begin: wp.array(dtype=wp.int32)  # the chunk's first vertex or triangle in the object


@launch.kernel
def project_vertices(
    first: int,
    # In:
    chunks: Chunks,
    objects: wp.array(dtype=ObjectRecord),
    rows: wp.array(dtype=wp.vec4d),  # three of each object drawn: pixels from its unit space
    # Out: (x, y, 1 / depth) in pixels in front of the camera; elsewhere (x depth, y depth, depth)
    corners_out: wp.array(dtype=wp.vec3d),
):
    """Project the vertices of one chunk."""
    chunk = first + wp.tid()
    index = chunks.object[chunk]
    vertices = objects[index].vertices
    first_vertex = objects[index].first_vertex
    has_outliers = objects[index].exact_vertices.shape[0] > 0
    place = 3 * chunks.place[chunk]
    row_x, row_y, row_z = rows[place], rows[place + 1], rows[place + 2]
    i = int(chunks.begin[chunk])
    end = wp.min(i + CHUNK, vertices.shape[0])
    while i < end:
        p = wp.vec4d(
            wp.float64(vertices[i][0]), wp.float64(vertices[i][1]), wp.float64(vertices[i][2]), wp.float64(1.0)
        )
        if has_outliers:
            exact = objects[index].exact_vertices[i]
            p = wp.vec4d(exact[0], exact[1], exact[2], wp.float64(1.0))
        x, y, depth = wp.dot(row_x, p), wp.dot(row_y, p), wp.dot(row_z, p)
        corner = wp.vec3d(x, y, wp.min(depth, BEHIND))
        if depth > NEAREST:
            nearness = wp.float64(1.0) / depth
            corner = wp.vec3d(x * nearness, y * nearness, nearness)
        corners_out[first_vertex + i] = corner
        i += 1


@wp.func
def homogeneous(corner: wp.vec3d) -> wp.vec3d:
    """(x depth, y depth, depth) of what ``project_vertices`` wrote."""
    if corner[2] > BEHIND:
        depth = wp.float64(1.0) / corner[2]
        return wp.vec3d(corner[0] * depth, corner[1] * depth, depth)
    return corner


def chunks_of(numbers: np.ndarray, counts: np.ndarray, device: wp.Device) -> tuple[Chunks, int]:
    """(``Chunks``, how many) of the objects of these numbers, which have so many vertices or triangles each."""
    chunks = -(-counts // int(CHUNK))
    place = np.repeat(np.arange(len(numbers)), chunks)
    begin = int(CHUNK) * (np.arange(len(place)) - np.repeat(np.cumsum(chunks) - chunks, chunks))
    made = Chunks()
    made.place, made.object, made.begin = (
        wp.array(values.astype(np.int32), dtype=wp.int32, device=device) for values in (place, numbers[place], begin)
    )
    return made, len(place)
