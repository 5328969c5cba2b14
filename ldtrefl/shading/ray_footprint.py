"""The footprint of a ray on the triangle that it meets, found for as many rays at once as a vector has lanes, in C++
(``ray_footprint.h``); and that of the ray that leaves there.

What neighbouring pixels see of a triangle's plane is how far their barycentrics are apart: its *spread*. Texture
coordinates and normals follow from that. Where triangles are smaller than pixels, this one stands for its neighbours.

Numbers of equations are those of H. Igehy, "Tracing Ray Differentials", 1999.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.bits import lowest_bit
from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.footprint import Footprint, turn_when_mirrored
from ldtrefl.shading import surfaces as surfaces_of
from ldtrefl.shading.surface import Surface
from ldtrefl.shading.surfaces import READ, Sighting, lanes_of
from ldtrefl.world.records import ObjectRecord

LEAST_COSINE = 0.02
"""The least cosine between a ray and a facet's normal that a footprint is divided by: one that grazes its facet covers
50 times the width of the ray, and no more."""

CONSTANTS = surfaces_of.CONSTANTS | {"LEAST_COSINE": LEAST_COSINE}
FILES = (*surfaces_of.FILES, "shading/ray_footprint.h")

SEEN = """
RayFootprints::Wide t;
RayFootprints::Three view, facet, normal;
for (int i = 0; i < Surfaces::WIDE; ++i) {
    const auto& sighting = sightings.data[lane[i]];
    const auto& surface = surfaces.data[lane[i]];
    at.weight.y[i] = sighting.u;
    at.weight.z[i] = sighting.v;
    view.x[i] = sighting.view[0];
    view.y[i] = sighting.view[1];
    view.z[i] = sighting.view[2];
    facet.x[i] = surface.facet[0];
    facet.y[i] = surface.facet[1];
    facet.z[i] = surface.facet[2];
    normal.x[i] = surface.normal[0];
    normal.y[i] = surface.normal[1];
    normal.z[i] = surface.normal[2];
}
at.weight.x = Surfaces::wide(1.0f) - at.weight.y - at.weight.z;
RayFootprints::Apart right, below;
"""
FROM_EYE = """
const float steps[2][3] = {
    {step_right[0], step_right[1], step_right[2]}, {step_down[0], step_down[1], step_down[2]}
};
RayFootprints::Three way;
for (int i = 0; i < Surfaces::WIDE; ++i) {
    const auto& along = sightings.data[lane[i]].way;
    const auto& position = surfaces.data[lane[i]].position;
    way.x[i] = (float)along[0];
    way.y[i] = (float)along[1];
    way.z[i] = (float)along[2];
    const float away[3] = {
        (float)(position[0] - eye[0]), (float)(position[1] - eye[1]), (float)(position[2] - eye[2])
    };
    t[i] = away[0] * away[0] + away[1] * away[1] + away[2] * away[2];
}
t = Surfaces::root(t);
const RayFootprints::Wide length = Surfaces::root(Surfaces::dot(way, way));
right = RayFootprints::from_eye(steps[0], view, length);
below = RayFootprints::from_eye(steps[1], view, length);
"""
ALONG = """
for (int i = 0; i < Surfaces::WIDE; ++i) {
    const auto& sighting = sightings.data[lane[i]];
    t[i] = sighting.t;
    right.place.x[i] = sighting.footprint.place_x[0];
    right.place.y[i] = sighting.footprint.place_x[1];
    right.place.z[i] = sighting.footprint.place_x[2];
    below.place.x[i] = sighting.footprint.place_y[0];
    below.place.y[i] = sighting.footprint.place_y[1];
    below.place.z[i] = sighting.footprint.place_y[2];
    right.turn.x[i] = sighting.footprint.turn_x[0];
    right.turn.y[i] = sighting.footprint.turn_x[1];
    right.turn.z[i] = sighting.footprint.turn_x[2];
    below.turn.x[i] = sighting.footprint.turn_y[0];
    below.turn.y[i] = sighting.footprint.turn_y[1];
    below.turn.z[i] = sighting.footprint.turn_y[2];
}
"""
MEET = """
const auto least = Surfaces::wide(LEAST_COSINE), cosine = -Surfaces::dot(view, facet);
const auto nearer = Surfaces::wide(1.0f) / Surfaces::chosen(cosine > least, cosine, least);
const auto edges = RayFootprints::edges_of(at);
const float* const turned = &record.unit_from_direction.data[0][0];
RayFootprints::Met met[2];
for (int axis = 0; axis < 2; ++axis) {
    const auto place = RayFootprints::place_on_plane(axis ? below : right, view, t, facet, nearer);
    met[axis] = RayFootprints::met_by(object, turned, record.unit_per_device, at, edges, normal, place);
}
for (int i = 0; i < Surfaces::WIDE; ++i) {
    auto& sighting = sightings.data[lane[i]];
    auto& footprint = sighting.footprint;
    const auto &x = met[0], &y = met[1];
    footprint.place_x = wp::vec3(x.place.x[i], x.place.y[i], x.place.z[i]);
    footprint.place_y = wp::vec3(y.place.x[i], y.place.y[i], y.place.z[i]);
    footprint.turn_x = wp::vec3(right.turn.x[i], right.turn.y[i], right.turn.z[i]);
    footprint.turn_y = wp::vec3(below.turn.x[i], below.turn.y[i], below.turn.z[i]);
    sighting.spread = wp::vec4(x.spread_u[i], x.spread_v[i], y.spread_u[i], y.spread_v[i]);
    sighting.normal_turn_x = wp::vec3(x.normal_turn.x[i], x.normal_turn.y[i], x.normal_turn.z[i]);
    sighting.normal_turn_y = wp::vec3(y.normal_turn.x[i], y.normal_turn.y[i], y.normal_turn.z[i]);
}
"""


@wp.func_native(native_body(CONSTANTS, FILES, READ + SEEN + FROM_EYE + MEET))
def meet_object_from(
    objects: wp.array(dtype=ObjectRecord),
    k: int,
    lanes: int,
    eye: wp.vec3d,
    step_right: wp.vec3,
    step_down: wp.vec3,
    sightings: wp.array(dtype=Sighting),
    surfaces: wp.array(dtype=Surface),
):
    """Let the rays of these lanes, a bit each, which look from ``eye`` along their ways, meet object ``k``."""
    ...


@wp.func_native(native_body(CONSTANTS, FILES, READ + SEEN + ALONG + MEET))
def meet_object_along(
    objects: wp.array(dtype=ObjectRecord),
    k: int,
    lanes: int,
    sightings: wp.array(dtype=Sighting),
    surfaces: wp.array(dtype=Surface),
):
    """Let the rays of these lanes, a bit each, meet object ``k``."""
    ...


@wp.func
def needs_footprints(objects: wp.array(dtype=ObjectRecord), k: int, rays_leave: bool) -> bool:
    """Whether footprints count on an object: colours are read from pictures, or may be, or rays leave it."""
    if rays_leave and objects[k].reflects != 0:
        return True
    return objects[k].look >= 0 or objects[k].texels.shape[0] + objects[k].texel_bytes.shape[0] > 0


@wp.func
def meet_from(
    objects: wp.array(dtype=ObjectRecord),
    lanes: int,
    eye: wp.vec3d,
    step_right: wp.vec3,
    step_down: wp.vec3,
    rays_leave: bool,
    sightings: wp.array(dtype=Sighting),
    surfaces: wp.array(dtype=Surface),
):
    """Find the footprints of an eye's rays where these lanes, a bit each, see surfaces (``look_from``): their own, the
    spread, and how normals turn. The ray of the next pixel is ``step_right`` and ``step_down`` away where the length
    along the camera's axis is 1. Of objects where they do not count they stay as they are."""
    left = lanes
    while left != 0:
        k = sightings[lowest_bit(wp.uint64(left))].object
        same = lanes_of(sightings, left, k)
        if needs_footprints(objects, k, rays_leave):
            meet_object_from(objects, k, same, eye, step_right, step_down, sightings, surfaces)
        left = left & ~same


@wp.func
def meet_along(
    objects: wp.array(dtype=ObjectRecord),
    lanes: int,
    sightings: wp.array(dtype=Sighting),
    surfaces: wp.array(dtype=Surface),
):
    """Find the footprints where these lanes, a bit each, have met surfaces (``look_along``) after their ``t``: of those
    that their rays had before, what they are there; the spread, and how normals turn."""
    left = lanes
    while left != 0:
        k = sightings[lowest_bit(wp.uint64(left))].object
        same = lanes_of(sightings, left, k)
        if needs_footprints(objects, k, True):
            meet_object_along(objects, k, same, sightings, surfaces)
        left = left & ~same


@wp.func
def leave(surface: Surface, sightings: wp.array(dtype=Sighting), lane: int, leaving: wp.vec3) -> Footprint:
    """The footprint of the ray that leaves a lane's surface along unit ``leaving``. The normal turns as the
    interpolated normal does, normal maps or not."""
    onwards = sightings[lane].footprint
    if surface.goes_through == 0:
        view, normal = sightings[lane].view, surface.normal
        turn_x = turn_when_mirrored(onwards.turn_x, view, normal, sightings[lane].normal_turn_x, leaving)
        turn_y = turn_when_mirrored(onwards.turn_y, view, normal, sightings[lane].normal_turn_y, leaving)
        onwards.turn_x = turn_x
        onwards.turn_y = turn_y
    return onwards
