"""A vertex where a mirror shows it.

The path from the eye by way of the mirror is unfolded: a virtual vertex stands on the line from the eye through the
reflection point, as far away as the path is long. On the screen it is where its reflection point is. Of a flat mirror
it is the mirrored vertex, and whatever is interpolated between virtual vertices with perspective is exact.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device import launch
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
    point: wp.vec3d  # the reflection point, on the reflector
    distance: float  # from the reflection point to the vertex, or what is as good: the depth test compares it
    depth: float  # of the reflection point along the camera's axis: it must lie before the reflector's back faces
    above: float  # fragments are left out where this, interpolated, is below 0
    is_seen: int  # 1; HIDDEN; or 0 if it is not known where it is: its triangles are left out


@wp.func
def device_vertex(record: ObjectRecord, vertex: int) -> wp.vec3d:
    """A vertex of an object in device space."""
    return wp.transform_point(record.device_from_unit, unit_vertex(record, vertex))


@launch.kernel
def find_points(
    first: int,
    # In:
    chunks: wp.array(dtype=wp.vec2i),  # ``chunks_of`` the vertices of objects
    numbers: wp.array(dtype=wp.int32),  # of these objects
    first_vertex: wp.array(dtype=wp.int32),  # place of vertex 0 of each of them
    objects: wp.array(dtype=ObjectRecord),
    # Out:
    points_out: wp.array(dtype=wp.vec3d),
):
    """Find where the vertices of one chunk are in device space."""
    place, begin = chunks[first + wp.tid()][0], chunks[first + wp.tid()][1]
    k = numbers[place]
    for i in range(begin, wp.min(begin + CHUNK, objects[k].vertices.shape[0])):
        points_out[first_vertex[place] + i] = device_vertex(objects[k], i)


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
    made.point = point
    made.distance = float(onwards)
    made.depth = float(depth)
    made.above = 1.0
    made.is_seen = wp.where(there > wp.float64(0.0) and made.distance > 0.0, 1, 0)
    return made
