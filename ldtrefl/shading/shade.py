"""Lighting, textures, Fresnel, environment: the one set of functions that every method shades with.

Outgoing radiance of a surface: ``emission + albedo * texture * (ambient + sum of lights) + mirror * reflected``.
Normals face the viewer. All directions are unit vectors in device space.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from ldtrefl.geometry.triangle import ONE_THIRD, plane_coordinates
from ldtrefl.geometry.vectors import as_double, as_single, from_to
from ldtrefl.world.records import LightingRecord, ObjectRecord

SMALLEST_NORMAL = wp.constant(1.0e-12)
"""Squared length below which a vertex normal says nothing and the facet's is taken."""

SMALLEST_SQUARE = wp.constant(1.0e-36)
"""Squared distance of a light that float32 can divide by: a light in the surface itself divides by no 0."""

LARGEST_RADIANCE = wp.constant(1.0e30)
"""What is brighter is shown as this: sums and products of such stay finite, and no pixel becomes infinite times 0."""

SMALLEST_SINE = wp.constant(1.0e-6)
"""Squared sine of a triangle's corner below which nothing is extended beyond it."""

FARTHEST_TURN = wp.constant(0.1)
"""Radians that a normal may turn beyond the triangle that it is known on. A smooth surface bends less over a patch."""


@wp.struct
class Surface:
    """A point of a surface, ready to be shaded."""

    position: wp.vec3d
    object: int
    triangle: int
    normal: wp.vec3  # shading normal, unit, on the viewer's side of the facet
    facet: wp.vec3  # facet normal, unit, facing the viewer
    albedo: wp.vec3  # times the texture
    emission: wp.vec3
    mirror: wp.vec3  # specular reflectance in this direction, Fresnel included


@wp.func
def at_most_largest(radiance: wp.vec3) -> wp.vec3:
    """A radiance that can be added and multiplied."""
    return wp.min(radiance, wp.vec3(LARGEST_RADIANCE))


@wp.func
def decoded_color(code: wp.vec3ub, decoded: wp.array(dtype=float)) -> wp.vec3:
    """The linear colour of a pixel of 8 bits, by the table of its values."""
    return wp.vec3(decoded[int(code[0])], decoded[int(code[1])], decoded[int(code[2])])


@wp.func
def texel(objects: wp.array(dtype=ObjectRecord), index: int, is_bytes: int, number: int) -> wp.vec3:
    """A texel of an object's textures, linear."""
    if is_bytes != 0:
        return decoded_color(objects[index].texel_bytes[number], objects[index].decoded)
    return objects[index].texels[number]


@wp.func
def sample_texture(objects: wp.array(dtype=ObjectRecord), index: int, place: wp.vec4i, uv: wp.vec2) -> wp.vec3:
    """Bilinear, repeating; v = 0 at the bottom row."""
    x = (uv[0] - wp.floor(uv[0])) * float(place[1]) - 0.5
    y = (1.0 - (uv[1] - wp.floor(uv[1]))) * float(place[2]) - 0.5
    left, top = wp.floor(x), wp.floor(y)
    fx, fy = x - left, y - top
    x0, y0 = (int(left) + place[1]) % place[1], (int(top) + place[2]) % place[2]
    x1, y1 = (x0 + 1) % place[1], (y0 + 1) % place[2]
    upper_row, lower_row = place[0] + y0 * place[1], place[0] + y1 * place[1]
    kind = place[3]
    upper = (1.0 - fx) * texel(objects, index, kind, upper_row + x0) + fx * texel(objects, index, kind, upper_row + x1)
    lower = (1.0 - fx) * texel(objects, index, kind, lower_row + x0) + fx * texel(objects, index, kind, lower_row + x1)
    return (1.0 - fy) * upper + fy * lower


@wp.func
def environment_radiance(lighting: LightingRecord, direction: wp.vec3) -> wp.vec3:
    """What a ray of this unit direction sees that hits nothing."""
    height = wp.dot(direction, lighting.up)
    if lighting.image_size[0] == 0:
        blend = 0.5 + 0.5 * height
        return blend * lighting.sky + (1.0 - blend) * lighting.ground
    return _environment_image(lighting, direction, height)


@wp.func
def environment_pixel(lighting: LightingRecord, row: int, column: int) -> wp.vec3:
    """A pixel of the environment's picture, linear."""
    if lighting.image_bytes.shape[0] > 0:
        return decoded_color(lighting.image_bytes[row, column], lighting.decoded)
    return lighting.image[row, column]


@wp.func
def _environment_image(lighting: LightingRecord, direction: wp.vec3, height: float) -> wp.vec3:
    """Equirectangular: ``up`` at the top row; for up = +z the middle column is +x and columns run clockwise."""
    # The axis of longitude 0 is +x made perpendicular to up, or +y where up is near x.
    reference = wp.vec3(1.0, 0.0, 0.0)
    if wp.abs(lighting.up[0]) > 0.9:
        reference = wp.vec3(0.0, 1.0, 0.0)
    ahead = wp.normalize(reference - wp.dot(reference, lighting.up) * lighting.up)
    left = wp.cross(lighting.up, ahead)
    rows, columns = lighting.image_size[0], lighting.image_size[1]
    longitude = wp.atan2(wp.dot(direction, left), wp.dot(direction, ahead))
    x = (0.5 - longitude / wp.TAU) * float(columns) - 0.5
    y = wp.acos(wp.clamp(height, -1.0, 1.0)) / wp.PI * float(rows) - 0.5
    x0f, y0f = wp.floor(x), wp.floor(y)
    fx, fy = x - x0f, y - y0f
    x0 = (int(x0f) + columns) % columns
    x1 = (x0 + 1) % columns
    y0, y1 = wp.clamp(int(y0f), 0, rows - 1), wp.clamp(int(y0f) + 1, 0, rows - 1)
    upper = (1.0 - fx) * environment_pixel(lighting, y0, x0) + fx * environment_pixel(lighting, y0, x1)
    lower = (1.0 - fx) * environment_pixel(lighting, y1, x0) + fx * environment_pixel(lighting, y1, x1)
    return (1.0 - fy) * upper + fy * lower


@wp.func
def schlick(reflectance: wp.vec3, cosine: float) -> wp.vec3:
    """Schlick's approximation of Fresnel reflectance (1994) from the value at normal incidence."""
    m = 1.0 - wp.clamp(cosine, 0.0, 1.0)
    return reflectance + (wp.vec3(1.0) - reflectance) * (m * m * m * m * m)


@wp.func
def mirror_direction(direction: wp.vec3, normal: wp.vec3) -> wp.vec3:
    """The direction reflected about the normal's plane (either side of it gives the same)."""
    return wp.normalize(direction - 2.0 * wp.dot(direction, normal) * normal)


@wp.func
def extended_coordinates(record: ObjectRecord, triangle: int, point: wp.vec3d) -> wp.vec2:
    """Barycentrics of a point about a triangle that stands for its neighbours, too: outside it they go on linearly.

    So shading is smooth over a patch of many triangles, though only one of them is known. Where normals are
    interpolated they go on until the normal has turned by ``FARTHEST_TURN``: the normals of a noisy mesh say nothing of
    their neighbours'. ``point`` is in device space.
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
    return middle + wp.min(1.0, FARTHEST_TURN * wp.length(na) / wp.max(turn, SMALLEST_NORMAL)) * offset


@wp.func
def surface_at(objects: wp.array(dtype=ObjectRecord), index: int, triangle: int, u: float, v: float, view: wp.vec3):
    """The surface of object ``index`` at barycentrics (u, v) of ``triangle``, seen along unit direction ``view``."""
    corners = objects[index].faces[triangle]
    w = 1.0 - u - v
    a, b, c = (
        objects[index].vertices[corners[0]],
        objects[index].vertices[corners[1]],
        objects[index].vertices[corners[2]],
    )
    surface = Surface()
    surface.object = index
    surface.triangle = triangle
    surface.position = wp.transform_point(objects[index].device_from_unit, as_double(w * a + u * b + v * c))

    # Turn the facet towards the viewer, and the interpolated normal to the facet's side: for that no length matters.
    across = wp.cross(b - a, c - a)
    away = objects[index].normal_from_unit * across
    if wp.dot(away, view) > 0.0:
        across = -across
        away = -away
    normal = wp.vec3(0.0)
    if objects[index].smooth != 0:
        interpolated = (
            w * objects[index].normals[corners[0]]
            + u * objects[index].normals[corners[1]]
            + v * objects[index].normals[corners[2]]
        )
        if wp.dot(interpolated, interpolated) > SMALLEST_NORMAL:
            normal = objects[index].normal_from_unit * wp.normalize(interpolated)
            if wp.dot(normal, away) < 0.0:
                normal = -normal
    # The facet's own normal is worked out where it is used.
    if normal == wp.vec3(0.0):
        normal = objects[index].normal_from_unit * wp.normalize(across)
    surface.facet = wp.normalize(objects[index].normal_from_unit * wp.normalize(across))
    surface.normal = wp.normalize(normal)

    # Find the part of the mesh that holds the triangle, and look up its colour.
    part = int(0)
    for next in range(1, objects[index].part_first.shape[0]):
        if objects[index].part_first[next] <= triangle:
            part = next
    color = wp.cw_mul(objects[index].albedo, objects[index].part_color[part])
    place = objects[index].part_texture[part]
    if place[1] > 0:
        uv = (
            w * objects[index].uvs[corners[0]] + u * objects[index].uvs[corners[1]] + v * objects[index].uvs[corners[2]]
        )
        color = wp.cw_mul(color, sample_texture(objects, index, place, uv))
    surface.albedo = color
    surface.emission = objects[index].emission
    surface.mirror = objects[index].mirror
    if objects[index].fresnel != 0:
        surface.mirror = schlick(surface.mirror, -wp.dot(surface.normal, view))
    return surface


def make_direct_radiance(is_lit: Any) -> Any:
    """The function ``direct_radiance(views, objects, lighting, surface)`` -> emitted and diffusely scattered radiance.

    ``is_lit(views, objects, surface, direction, distance)`` answers whether light arrives from unit ``direction``, from
    a light at ``distance``; it closes over a tracer, so shadows exist once for all tracers.
    """

    @wp.func
    def direct_radiance(
        views: Any, objects: wp.array(dtype=ObjectRecord), lighting: LightingRecord, surface: Surface
    ) -> wp.vec3:
        total = lighting.ambient
        for i in range(lighting.lights.shape[0]):
            towards = lighting.lights[i].towards
            radiance = lighting.lights[i].radiance
            distance = float(wp.inf)
            if lighting.lights[i].is_point != 0:
                offset = from_to(surface.position, lighting.lights[i].position)
                distance = wp.length(offset)
                towards = wp.normalize(offset)
                radiance = at_most_largest(radiance / wp.max(distance * distance, SMALLEST_SQUARE))
            cosine = wp.dot(surface.normal, towards)
            if cosine > 0.0:
                if is_lit(views, objects, surface, towards, distance):
                    total += cosine * radiance
        return at_most_largest(surface.emission + wp.cw_mul(surface.albedo, total))

    return direct_radiance
