"""A vertex where a mirror shows it.

The path from the eye by way of the mirror is unfolded: a virtual vertex stands on the line from the eye through the
reflection point, as far away as the path is long. On the screen it is where its reflection point is. Of a flat mirror
it is the mirrored vertex, and whatever is interpolated between virtual vertices with perspective is exact.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.bins import CHUNK
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.unit_rays import unit_vertex

HIDDEN = wp.constant(2)
"""Of a vertex behind the reflector, which is placed so that triangles between it and others are right where they are
seen: triangles between hidden ones alone are left out."""


@wp.struct
class VirtualVertex:
    """A vertex as a mirror shows it, in device space."""

    position: wp.vec3d
    distance: float  # from the reflection point to the vertex, or what is as good: the depth test compares it
    depth: float  # of the reflection point along the camera's axis: it must lie before the reflector's back faces
    above: float  # fragments are left out where this, interpolated, is below 0
    is_seen: int  # 1; HIDDEN; or 0 if it is not known where it is: its triangles are left out


@wp.struct
class VertexChunk:
    """Vertices of an object that one item of a launch places."""

    object: int  # -1: none
    begin: int
    end: int
    first: int  # place of the object's vertex 0 among all virtual vertices


@wp.func
def vertex_chunk(
    chunks: wp.array(dtype=wp.vec2i),
    numbers: wp.array(dtype=wp.int32),
    first_vertex: wp.array(dtype=wp.int32),
    objects: wp.array(dtype=ObjectRecord),
    i: int,
) -> VertexChunk:
    """Chunk ``i`` of those of ``chunks_of`` the vertices of objects of these numbers."""
    place = chunks[i][0]
    chunk = VertexChunk()
    chunk.object = numbers[place]
    chunk.begin = chunks[i][1]
    chunk.end = wp.min(chunk.begin + CHUNK, objects[chunk.object].vertices.shape[0])
    chunk.first = first_vertex[place]
    return chunk


@wp.func
def device_vertex(record: ObjectRecord, vertex: int) -> wp.vec3d:
    """A vertex of an object in device space."""
    return wp.transform_point(record.device_from_unit, unit_vertex(record, vertex))


@wp.func
def not_seen() -> VirtualVertex:
    """A vertex that a mirror does not show."""
    vertex = VirtualVertex()
    vertex.distance = 1.0
    return vertex


@wp.func
def unfolded(eye: wp.vec3d, point: wp.vec3d, vertex: wp.vec3d, depth: wp.float64) -> VirtualVertex:
    """A vertex that is seen from ``eye`` at a reflection point, whose depth along the camera's axis is given."""
    there, onwards = wp.length(point - eye), wp.length(vertex - point)
    made = VirtualVertex()
    made.position = eye + (point - eye) * ((there + onwards) / there)
    made.distance = float(onwards)
    made.depth = float(depth)
    made.above = 1.0
    made.is_seen = wp.where(there > wp.float64(0.0) and made.distance > 0.0, 1, 0)
    return made
