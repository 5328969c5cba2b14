"""Rays in an object's unit space: how they get there, start near the object, and leave its surface.

One way for every tracer. Origins are float64 until the ray has come near: a small object far from where the ray starts,
or in a scene that is a million times larger, is met as precisely as alone.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.vectors import as_double, as_single
from ldtrefl.world.records import ObjectRecord

NEAR = wp.constant(wp.float64(8.0))
"""Unit space: coordinates up to which float32 does for where a ray starts."""

SPHERE = wp.constant(wp.float64(1.75))
"""Radius of a sphere about the unit cube."""

LEAVING = wp.constant(wp.float64(1.0e-6))
"""How far above its own triangle a ray leaves, unit space: 16 roundings of a float32. A point of
a triangle is off by three, and what tests it again by as many (Waechter and Binder 2019, "A Fast and Robust Method for
Avoiding Self-Intersection")."""


@wp.struct
class UnitRay:
    """A ray in an object's unit space."""

    start: wp.vec3d
    way: wp.vec3  # unit
    stretch: float  # length in unit space of a device unit along the ray


@wp.func
def into_unit(record: ObjectRecord, origin: wp.vec3d, direction: wp.vec3) -> UnitRay:
    """A ray of device space in the unit space of an object."""
    ray = UnitRay()
    way = record.unit_from_direction * direction
    length = wp.length(way)
    ray.stretch = length * record.unit_per_device
    ray.way = way / length
    ray.start = wp.transform_point(record.unit_from_device, origin)
    return ray


@wp.func
def distance_passed(origin: wp.vec3d, direction: wp.vec3, radius: wp.float64) -> float:
    """How far, in lengths of ``direction``, a ray may go before it comes to a sphere about the unit cube: in float64,
    which rounds its start the less the nearer it has come."""
    way = as_double(direction)
    square = wp.dot(way, way)
    along = -wp.dot(origin, way) - radius * wp.sqrt(square)
    return float(wp.max(along, wp.float64(0.0)) / square)


@wp.func
def unit_vertex(record: ObjectRecord, vertex: int) -> wp.vec3d:
    """A vertex in unit space, as exactly as it is known."""
    if record.exact_vertices.shape[0] > 0:
        return record.exact_vertices[vertex]
    return as_double(record.vertices[vertex])


@wp.func
def unit_normal(record: ObjectRecord, normal: wp.vec3) -> wp.vec3:
    """A normal of device space in the unit space of an object, unit."""
    return wp.normalize(as_single(wp.transform_vector(wp.transpose(record.device_from_unit), as_double(normal))))


@wp.func
def start_above(start: wp.vec3d, outwards: wp.vec3) -> wp.vec3d:
    """Where a ray starts for an object that may touch the surface that it leaves to the side of ``outwards``: above it
    by the rounding of that object's own coordinates. In its unit space."""
    return start + LEAVING * as_double(outwards)


@wp.func
def start_above_own(record: ObjectRecord, triangle: int, start: wp.vec3d, outwards: wp.vec3) -> wp.vec3d:
    """Where a ray starts for the object that it leaves: above the plane of its own triangle by the rounding of the
    coordinates there. What met the ray may have left ``start`` a little off that plane. In unit space."""
    corners = record.faces[triangle]
    a = unit_vertex(record, corners[0])
    across = wp.cross(unit_vertex(record, corners[1]) - a, unit_vertex(record, corners[2]) - a)
    if across == wp.vec3d(wp.float64(0.0)):
        return start
    normal = wp.normalize(across)
    if wp.dot(normal, as_double(outwards)) < wp.float64(0.0):
        normal = -normal
    # No coordinate of the bulk is larger than 1, and what lies outside is tested in float64.
    return start + (LEAVING - wp.dot(normal, start - a)) * normal
