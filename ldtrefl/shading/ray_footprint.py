"""The footprint of a ray on the triangle that it meets, and of the ray that leaves there.

What neighbouring pixels see of a triangle's plane is how far their barycentrics are apart: its *spread*. Texture
coordinates and normals follow from that. Where triangles are smaller than pixels, this one stands for its neighbours.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.footprint import Footprint, footprint_on_plane, turn_when_mirrored
from ldtrefl.shading.surface import Surface
from ldtrefl.shading.surfaces import Sighting
from ldtrefl.world.records import ObjectRecord


@wp.func
def barycentrics_of(
    objects: wp.array(dtype=ObjectRecord), k: int, triangle: int, place_x: wp.vec3, place_y: wp.vec3
) -> wp.vec4:
    """How far barycentrics (u, v) change from a point of a triangle to two others, as (u to x, v to x, u to y, v to y);
    0 for a triangle without area. The ways to the two are in device space, about in the triangle's plane."""
    corners = objects[k].faces[triangle]
    a = objects[k].vertices[corners[0]]
    e, f = objects[k].vertices[corners[1]] - a, objects[k].vertices[corners[2]] - a
    x = objects[k].unit_per_device * (objects[k].unit_from_direction * place_x)
    y = objects[k].unit_per_device * (objects[k].unit_from_direction * place_y)
    ee, ef, ff = wp.dot(e, e), wp.dot(e, f), wp.dot(f, f)
    determinant = ee * ff - ef * ef
    if determinant <= 0.0:
        return wp.vec4(0.0)
    xe, xf, ye, yf = wp.dot(x, e), wp.dot(x, f), wp.dot(y, e), wp.dot(y, f)
    return wp.vec4(ff * xe - ef * xf, ee * xf - ef * xe, ff * ye - ef * yf, ee * yf - ef * ye) / determinant


@wp.func
def is_textured(objects: wp.array(dtype=ObjectRecord), k: int) -> bool:
    """Whether an object's colours are read from pictures, or may be."""
    return objects[k].look >= 0 or objects[k].texels.shape[0] + objects[k].texel_bytes.shape[0] > 0


@wp.func
def meet(
    objects: wp.array(dtype=ObjectRecord),
    arriving: Footprint,
    t: float,
    surface: Surface,
    sightings: wp.array(dtype=Sighting),
    lane: int,
) -> Footprint:
    """The footprint where a lane's ray, of length ``t``, meets its surface; the lane's spread is set where the surface
    is smooth or textured, which need it."""
    met = footprint_on_plane(arriving, sightings[lane].view, t, surface.facet)
    k = surface.object
    if objects[k].smooth != 0 or is_textured(objects, k):
        sightings[lane].spread = barycentrics_of(objects, k, surface.triangle, met.place_x, met.place_y)
    return met


@wp.func
def normal_turn(
    objects: wp.array(dtype=ObjectRecord), k: int, triangle: int, mean: wp.vec3, u: float, v: float, normal: wp.vec3
) -> wp.vec3:
    """From a point's unit shading normal to that of a neighbour whose barycentrics differ by (u, v). ``mean`` is the
    interpolated normal as it is in unit space, of any length; ``normal`` faces the viewer."""
    corners = objects[k].faces[triangle]
    first = objects[k].normals[corners[0]]
    change = u * (objects[k].normals[corners[1]] - first) + v * (objects[k].normals[corners[2]] - first)
    across = objects[k].normal_from_unit * mean
    length = wp.length(across)
    if not length > 0.0:
        return wp.vec3(0.0)
    turn = (objects[k].normal_from_unit * change) / length
    turn = wp.where(wp.dot(across, normal) < 0.0, -turn, turn)
    return turn - wp.dot(turn, normal) * normal


@wp.func
def leave(
    objects: wp.array(dtype=ObjectRecord),
    met: Footprint,
    surface: Surface,
    sightings: wp.array(dtype=Sighting),
    lane: int,
    leaving: wp.vec3,
) -> Footprint:
    """The footprint of the ray that leaves a lane's surface along unit ``leaving``, of that which met it. The normal
    turns as the interpolated normal does, normal maps or not."""
    onwards = Footprint()
    onwards.place_x = met.place_x
    onwards.place_y = met.place_y
    if surface.goes_through != 0:
        onwards.turn_x = met.turn_x
        onwards.turn_y = met.turn_y
        return onwards
    k = surface.object
    turn_x, turn_y = wp.vec3(0.0), wp.vec3(0.0)
    if objects[k].smooth != 0:
        u, v, spread = sightings[lane].u, sightings[lane].v, sightings[lane].spread
        corners = objects[k].faces[surface.triangle]
        mean = (1.0 - u - v) * objects[k].normals[corners[0]]
        mean += u * objects[k].normals[corners[1]] + v * objects[k].normals[corners[2]]
        turn_x = normal_turn(objects, k, surface.triangle, mean, spread[0], spread[1], surface.normal)
        turn_y = normal_turn(objects, k, surface.triangle, mean, spread[2], spread[3], surface.normal)
    view = sightings[lane].view
    onwards.turn_x = turn_when_mirrored(met.turn_x, view, surface.normal, turn_x, leaving)
    onwards.turn_y = turn_when_mirrored(met.turn_y, view, surface.normal, turn_y, leaving)
    return onwards
