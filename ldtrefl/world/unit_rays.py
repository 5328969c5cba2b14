"""Rays in an object's unit space: how they get there, where they start being searched for, how they leave a surface.

Every tracer uses these functions. A ray's origin is float64 until the ray is near the object. So a small object that is
far from where the ray starts, or stands in a scene a million times larger, is met as precisely as if it were alone.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.triangle import facet_normal
from ldtrefl.geometry.vectors import as_double, as_single
from ldtrefl.world.records import ObjectRecord

NEAR = wp.constant(wp.float64(8.0))
"""Unit space: the largest coordinate of a ray's origin for which float32 is precise enough."""

SPHERE_RADIUS = wp.constant(wp.float64(1.75))
"""Unit space: radius of a sphere about 0 that holds the unit cube, whose corners are 1.732 away."""

LEAVING = wp.constant(wp.float64(1.0e-6))
"""Unit space: how far above its own triangle a ray starts. That is 16 roundings of a float32. A point of a triangle is
off by three of them, and a test against the triangle by as many (Waechter and Binder 2019, "A Fast and Robust Method
for Avoiding Self-Intersection")."""


@wp.struct
class UnitRay:
    """A ray in an object's unit space."""

    origin: wp.vec3d
    direction: wp.vec3  # unit
    stretch: float  # length in unit space of a device unit along the ray


@wp.func
def into_unit(record: ObjectRecord, origin: wp.vec3d, direction: wp.vec3) -> UnitRay:
    """A ray of device space in the unit space of an object."""
    ray = UnitRay()
    scaled = record.unit_from_direction * direction
    length = wp.length(scaled)
    ray.stretch = length * record.unit_per_device
    ray.direction = scaled / length
    ray.origin = wp.transform_point(record.unit_from_device, origin)
    return ray


@wp.func
def distance_passed(origin: wp.vec3d, direction: wp.vec3, radius: wp.float64) -> wp.float64:
    """The t that a ray may skip, because it is still outside a sphere about the unit cube; 0 if it starts inside.

    Found in float64: the ray's new origin, near the object, is then rounded to float32 without loss.
    """
    exact = as_double(direction)
    square = wp.dot(exact, exact)
    along = -wp.dot(origin, exact) - radius * wp.sqrt(square)
    return wp.max(along, wp.float64(0.0)) / square


@wp.func
def unit_vertex(record: ObjectRecord, vertex: int) -> wp.vec3d:
    """A vertex in unit space: in float64 if the mesh has outliers, else its float32 coordinates."""
    if record.exact_vertices.shape[0] > 0:
        return record.exact_vertices[vertex]
    return as_double(record.vertices[vertex])


@wp.func
def unit_normal(record: ObjectRecord, normal: wp.vec3) -> wp.vec3:
    """A normal of device space, brought to the unit space of an object and to unit length."""
    return wp.normalize(as_single(wp.transform_vector(wp.transpose(record.device_from_unit), as_double(normal))))


@wp.func
def start_above(start: wp.vec3d, outwards: wp.vec3) -> wp.vec3d:
    """Where a ray starts that leaves one object's surface and is searched for in another, which may touch it.

    It starts above the surface, to the side of ``outwards``, by the rounding of the other object's coordinates. All is
    in the other object's unit space.
    """
    return start + LEAVING * as_double(outwards)


@wp.func
def facet_towards(record: ObjectRecord, triangle: int, outwards: wp.vec3) -> wp.vec3d:
    """A triangle's unit normal in unit space, to the side of ``outwards``; 0 if the triangle has no area."""
    corners = record.faces[triangle]
    a, b, c = unit_vertex(record, corners[0]), unit_vertex(record, corners[1]), unit_vertex(record, corners[2])
    normal = facet_normal(a, b, c)
    if wp.dot(normal, as_double(outwards)) < wp.float64(0.0):
        return -normal
    return normal


@wp.func
def start_above_own(record: ObjectRecord, triangle: int, start: wp.vec3d, normal: wp.vec3d) -> wp.vec3d:
    """Where a ray starts that is searched for in the object that it leaves, in unit space.

    It starts above the plane of the triangle that it leaves, to the side of ``normal`` (:func:`facet_towards`), by the
    rounding of coordinates there. ``start`` may lie a little off that plane: its hit was rounded, or was on a patch.
    """
    if normal == wp.vec3d(wp.float64(0.0)):
        return start
    a = unit_vertex(record, record.faces[triangle][0])
    # No coordinate of the bulk is larger than 1, and what lies outside is tested in float64.
    return start + (LEAVING - wp.dot(normal, start - a)) * normal
