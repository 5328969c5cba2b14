"""A point of an object's surface as it is shaded: position, normals, colours, and specular reflectance.

Normals face the viewer. All directions are unit vectors in device space.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.triangle import ONE_THIRD, plane_coordinates
from ldtrefl.geometry.vectors import as_single
from ldtrefl.shading.specular import mirror_direction
from ldtrefl.shading.textures import sample_texture
from ldtrefl.world.records import ObjectRecord

LEAST_TURN = wp.constant(1.0e-12)
"""Turns of a normal below this count as this."""

SMALLEST_SINE = wp.constant(1.0e-6)
"""Squared sine of a triangle's corner below which barycentrics are not extended beyond the triangle."""

FARTHEST_TURN = wp.constant(0.1)
"""Radians that a normal may turn beyond the triangle that it is known on. A smooth surface bends less over a patch."""


EDGE_ON = wp.constant(1.0e-5)
"""Cosine of a view with a facet's normal, in units of the largest entry of ``normal_from_unit``, below which rounding
decides which side is seen."""

AREA_ROUNDING = wp.constant(2.0e-6)
"""Rounding of a triangle's normal, as a share of the product of two of its sides."""


@wp.struct
class Surface:
    """A point of a surface, ready to be shaded."""

    position: wp.vec3d
    object: int
    triangle: int
    normal: wp.vec3  # shading normal, unit, on the viewer's side of the facet
    facet: wp.vec3  # facet normal, unit, facing the viewer
    is_back: int  # 1 if the viewer sees the triangle's back, by its winding
    albedo: wp.vec3  # times the texture
    emission: wp.vec3
    mirror: wp.vec3  # specular reflectance in this direction, Fresnel included; or what is let through
    goes_through: int  # 1 if rays go straight on behind it, rather than being mirrored


@wp.func
def extended_coordinates(record: ObjectRecord, triangle: int, point: wp.vec3d) -> wp.vec2:
    """Barycentrics of a point near a triangle, extended linearly beyond its edges.

    The triangle of a patch stands for its neighbours, too: only this one is known. With extended barycentrics shading
    is smooth over the whole patch. Where normals are interpolated, barycentrics are extended only until the normal has
    turned by ``FARTHEST_TURN``: on a noisy mesh a triangle's normals say nothing about its neighbours'. ``point`` is in
    device space.
    """
    corners = record.faces[triangle]
    a, b, c = record.vertices[corners[0]], record.vertices[corners[1]], record.vertices[corners[2]]
    middle = wp.vec2(ONE_THIRD, ONE_THIRD)
    at = plane_coordinates(a, b, c, as_single(wp.transform_point(record.unit_from_device, point)))
    if not at[2] > SMALLEST_SINE:
        return middle
    offset = wp.vec2(at[0], at[1]) - middle
    if record.smooth == 0:
        return middle + offset  # there may be no normals, and none is interpolated
    na = record.normals[corners[0]]
    turn = wp.length(offset[0] * (record.normals[corners[1]] - na) + offset[1] * (record.normals[corners[2]] - na))
    return middle + wp.min(1.0, FARTHEST_TURN * wp.length(na) / wp.max(turn, LEAST_TURN)) * offset


@wp.func
def part_of(objects: wp.array(dtype=ObjectRecord), index: int, triangle: int) -> int:
    """The part of an object's mesh that holds a triangle, by bisection."""
    low = int(0)
    high = objects[index].part_first.shape[0]
    while high - low > 1:
        middle = (low + high) / 2
        if objects[index].part_first[middle] <= triangle:
            low = middle
        else:
            high = middle
    return low


@wp.func
def albedo_at(objects: wp.array(dtype=ObjectRecord), index: int, triangle: int, u: float, v: float) -> wp.vec3:
    """The albedo at barycentrics (u, v) of a triangle: the object's, times that of the mesh's part and its texture."""
    part = part_of(objects, index, triangle)
    color = wp.cw_mul(objects[index].albedo, objects[index].part_color[part])
    place = objects[index].part_texture[part]
    if place[1] > 0:
        corners = objects[index].faces[triangle]
        uv = (
            (1.0 - u - v) * objects[index].uvs[corners[0]]
            + u * objects[index].uvs[corners[1]]
            + v * objects[index].uvs[corners[2]]
        )
        color = wp.cw_mul(color, sample_texture(objects, index, place, uv))
    return color


@wp.func
def may_see_back(record: ObjectRecord, triangle: int, view: wp.vec3) -> bool:
    """Whether the back of a triangle is seen along a unit direction: true, too, where rounding decides."""
    corners = record.faces[triangle]
    a, b, c = record.vertices[corners[0]], record.vertices[corners[1]], record.vertices[corners[2]]
    across = wp.cross(b - a, c - a)
    rounding = EDGE_ON * wp.length(across) + AREA_ROUNDING * wp.length(b - a) * wp.length(c - a)
    return wp.dot(record.normal_from_unit * across, view) >= -rounding


@wp.func
def way_onwards(surface: Surface, direction: wp.vec3) -> wp.vec3:
    """The unit direction in which a ray goes on that arrives along ``direction``: mirrored, or straight on."""
    if surface.goes_through != 0:
        return direction
    return mirror_direction(direction, surface.normal, surface.facet)


@wp.func
def may_return(record: ObjectRecord, surface: Surface) -> bool:
    """Whether a ray that goes on from a surface may meet the object that it leaves."""
    side = surface.is_back  # that it leaves
    if surface.goes_through != 0:
        side = 1 - side
    return ((record.returns >> side) & 1) != 0
