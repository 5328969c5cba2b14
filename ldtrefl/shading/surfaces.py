"""Surfaces where rays end, found for as many rays at once as a vector has lanes, in C++ (``surfaces.h``).

Rays come in groups. What is read of an object is read once for all rays of a group that see it, and its surface is then
found in vectors: on the CPU eight rays at a time, on CUDA one. ``surface.py`` says what a surface is.
"""

from __future__ import annotations

from collections.abc import Callable

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit
from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.footprint import Footprint
from ldtrefl.shading.specular import schlick
from ldtrefl.shading.surface import Surface, albedo_at, part_of
from ldtrefl.shading.textures import texture_mean
from ldtrefl.world.records import ObjectRecord

GROUP = wp.constant(8)
"""Rays of a group, at most."""

SMALLEST_NORMAL = 1.0e-12
"""Squared length of an interpolated normal below which the facet's normal is taken."""


@wp.struct
class Sighting:
    """A point of an object's surface, and the direction that it is seen along."""

    object: int  # -1 if none is seen
    triangle: int
    u: float  # barycentrics
    v: float
    view: wp.vec3  # unit; 0 if the eye touches the point
    way: wp.vec3d  # the same of any length, for what is looked at from an eye
    # Only where footprints are followed (``ray_footprint.py``):
    t: float  # length of the ray
    footprint: Footprint  # of the ray where it starts, then where it meets the surface
    spread: wp.vec4  # by which barycentrics change to the next pixel: u and v to the right, then below
    normal_turn_x: wp.vec3  # from the point's unit shading normal to that of the next pixel
    normal_turn_y: wp.vec3


CONSTANTS: dict[str, float | int] = {"SMALLEST_NORMAL": SMALLEST_NORMAL}
FILES = ("device/vectors.h", "shading/surfaces.h")

READ = """
const auto& record = objects.data[k];
Surfaces::Object object;
object.vertices = (const float*)record.vertices.data;
object.exact_vertices = record.exact_vertices.shape[0] ? (const double*)record.exact_vertices.data : nullptr;
object.normals = record.smooth ? (const float*)record.normals.data : nullptr;
object.faces = (const int*)record.faces.data;
object.device_from_unit = &record.device_from_unit.data[0][0];
object.unit_from_device = &record.unit_from_device.data[0][0];
object.normal_from_unit = &record.normal_from_unit.data[0][0];
// Lanes that are not asked for do what the first one does that is.
int lane[Surfaces::WIDE], triangle[Surfaces::WIDE];
for (int i = 0; i < Surfaces::WIDE; ++i) {
    lane[i] = lanes >> i & 1 ? i : Surfaces::lowest_bit(lanes);
    triangle[i] = sightings.data[lane[i]].triangle;
}
Surfaces::Points at;
Surfaces::find_corners(object, triangle, at);
"""
FROM_EYE = """
const double from[3] = {eye[0], eye[1], eye[2]};
Surfaces::ThreeDouble way;
for (int i = 0; i < Surfaces::WIDE; ++i) {
    const auto& along = sightings.data[lane[i]].way;
    way.x[i] = along[0];
    way.y[i] = along[1];
    way.z[i] = along[2];
}
Surfaces::place_on_rays(object, triangle, from, way, at);
const Surfaces::Three view = Surfaces::unit(Surfaces::single_of(way));
for (int i = 0; i < Surfaces::WIDE; ++i) {
    auto& sighting = sightings.data[lane[i]];
    sighting.view = wp::vec3(view.x[i], view.y[i], view.z[i]);
    sighting.u = at.weight.y[i];
    sighting.v = at.weight.z[i];
}
"""
ALONG = """
Surfaces::Wide u, v;
Surfaces::Three view;
for (int i = 0; i < Surfaces::WIDE; ++i) {
    const auto& sighting = sightings.data[lane[i]];
    u[i] = sighting.u;
    v[i] = sighting.v;
    view.x[i] = sighting.view[0];
    view.y[i] = sighting.view[1];
    view.z[i] = sighting.view[2];
}
Surfaces::place_at(object, u, v, at);
"""
STORE = """
const Surfaces::Found found = Surfaces::normals_at(object, at, view);
const auto albedo = wp::cw_mul(record.albedo, record.part_color.data[0]);
for (int i = 0; i < Surfaces::WIDE; ++i) {
    auto& surface = surfaces.data[lane[i]];
    surface.object = k;
    surface.triangle = triangle[i];
    surface.position = wp::vec3d(at.position.x[i], at.position.y[i], at.position.z[i]);
    surface.normal = wp::vec3(found.normal.x[i], found.normal.y[i], found.normal.z[i]);
    surface.facet = wp::vec3(found.facet.x[i], found.facet.y[i], found.facet.z[i]);
    surface.is_back = found.is_back[i] != 0;
    surface.albedo = albedo;
    surface.emission = record.emission;
    surface.mirror = record.mirror;
    surface.goes_through = 0;
}
"""


@wp.func_native(native_body(CONSTANTS, FILES, READ + FROM_EYE + STORE))
def surfaces_of_object_from(
    objects: wp.array(dtype=ObjectRecord),
    k: int,
    lanes: int,
    eye: wp.vec3d,
    sightings: wp.array(dtype=Sighting),
    surfaces: wp.array(dtype=Surface),
):
    """Find the surface of object ``k`` for these lanes, a bit each, which see its triangles from ``eye`` along their
    ways; and their barycentrics and views."""
    ...


@wp.func_native(native_body(CONSTANTS, FILES, READ + ALONG + STORE))
def surfaces_of_object_along(
    objects: wp.array(dtype=ObjectRecord),
    k: int,
    lanes: int,
    sightings: wp.array(dtype=Sighting),
    surfaces: wp.array(dtype=Surface),
):
    """Find the surface of object ``k`` for these lanes, a bit each, at their barycentrics, along their views."""
    ...


@wp.func
def lanes_of(sightings: wp.array(dtype=Sighting), left: int, k: int) -> int:
    """Of these lanes, a bit each, those that see object ``k``."""
    lanes = int(0)
    while left != 0:
        bit = left & -left
        if sightings[lowest_bit(wp.uint64(left))].object == k:
            lanes = lanes | bit
        left = left & ~bit
    return lanes


@wp.func
def look_from(
    objects: wp.array(dtype=ObjectRecord),
    lanes: int,
    eye: wp.vec3d,
    sightings: wp.array(dtype=Sighting),
    surfaces: wp.array(dtype=Surface),
):
    """Find the surfaces that these lanes see, a bit each: where rays from an eye along their ways meet their triangles.
    Their barycentrics and views are set, too. ``color_surface`` sets what is left."""
    left = lanes
    while left != 0:
        k = sightings[lowest_bit(wp.uint64(left))].object
        same = lanes_of(sightings, left, k)
        surfaces_of_object_from(objects, k, same, eye, sightings, surfaces)
        left = left & ~same


@wp.func
def look_along(
    objects: wp.array(dtype=ObjectRecord),
    lanes: int,
    sightings: wp.array(dtype=Sighting),
    surfaces: wp.array(dtype=Surface),
):
    """Find the surfaces at these lanes' barycentrics, a bit each, along their views. ``color_surface`` sets what is
    left."""
    left = lanes
    while left != 0:
        k = sightings[lowest_bit(wp.uint64(left))].object
        same = lanes_of(sightings, left, k)
        surfaces_of_object_along(objects, k, same, sightings, surfaces)
        left = left & ~same


@launch.once
def coloring(probes: int) -> Callable[..., None]:
    """``color_surface(objects, sightings, lane, surfaces)``: set those colours of a lane's surface that are not the
    same on all of its object. Textures are read at its point, or with ``probes`` above 0 over its spread."""
    filters = wp.constant(probes > 0)
    mean_of_texture = texture_mean(max(probes, 1))

    @wp.func
    def color_surface(
        objects: wp.array(dtype=ObjectRecord),
        sightings: wp.array(dtype=Sighting),
        lane: int,
        surfaces: wp.array(dtype=Surface),
    ):
        index = sightings[lane].object
        if objects[index].part_first.shape[0] > 1 or objects[index].part_texture[0][1] > 0:
            u, v, triangle = sightings[lane].u, sightings[lane].v, sightings[lane].triangle
            if filters:
                part = part_of(objects, index, triangle)
                color = wp.cw_mul(objects[index].albedo, objects[index].part_color[part])
                if objects[index].part_texture[part][1] > 0:
                    spread = sightings[lane].spread
                    mean = mean_of_texture(objects, index, part, triangle, u, v, spread)
                    color = wp.cw_mul(color, mean)
                surfaces[lane].albedo = color
            else:
                surfaces[lane].albedo = albedo_at(objects, index, triangle, u, v)
        if objects[index].fresnel != 0:
            cosine = -wp.dot(surfaces[lane].normal, sightings[lane].view)
            surfaces[lane].mirror = schlick(objects[index].mirror, cosine)

    return color_surface
