"""Shapes of lights as rays and rough surfaces see them: which a ray meets, and where one is nearest to a direction.

Spheres are seen from outside, rectangles from the side that they shine to; other rays pass.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.sphere import sphere_entry
from ldtrefl.geometry.vectors import from_to
from ldtrefl.world.records import RECTANGLE, SPHERE, LightingRecord, ShapedLightRecord

GRAZING = wp.constant(1.0e-6)
"""The least cosine that a direction is taken to have with a rectangle whose nearest point to it is looked for."""


@wp.func
def rectangle_entry(light: ShapedLightRecord, origin: wp.vec3d, direction: wp.vec3) -> float:
    """Where a ray meets the side of a rectangle that shines; -1 if it does not."""
    offset = from_to(origin, light.position)
    approach = wp.dot(direction, light.axis)
    if approach >= 0.0:
        return -1.0
    t = wp.dot(offset, light.axis) / approach
    at = t * direction - offset
    is_met = wp.abs(wp.dot(at, light.right)) <= wp.dot(light.right, light.right)
    is_met = is_met and wp.abs(wp.dot(at, light.up)) <= wp.dot(light.up, light.up)
    return wp.where(is_met, t, -1.0)


@wp.func
def seen_light(lighting: LightingRecord, origin: wp.vec3d, direction: wp.vec3, t_max: float) -> int:
    """The number of the first light whose shape a ray of unit direction meets before ``t_max``; -1 for none."""
    nearest = float(t_max)
    found = int(-1)
    for i in range(lighting.shaped.shape[0]):
        if lighting.shaped[i].visible != 0:
            t = float(-1.0)
            if lighting.shaped[i].kind == SPHERE:
                t = sphere_entry(origin, direction, lighting.shaped[i].position, lighting.shaped[i].radius)
            else:
                t = rectangle_entry(lighting.shaped[i], origin, direction)
            if t > 0.0 and t < nearest:
                nearest = t
                found = i
    return found


@wp.func
def nearest_in_light(light: ShapedLightRecord, offset: wp.vec3, way: wp.vec3) -> wp.vec3:
    """The unit direction to the point of a light that is nearest to a ray from 0 along unit ``way``: B. Karis, "Real
    Shading in Unreal Engine 4" (2013), of rectangles where the ray meets their plane."""
    if light.kind == RECTANGLE:
        # A ray that goes away from the plane is taken for one that grazes it.
        t = wp.dot(offset, light.axis) / wp.min(wp.dot(way, light.axis), -GRAZING)
        at = t * way - offset
        x = wp.clamp(wp.dot(at, light.right) / wp.dot(light.right, light.right), -1.0, 1.0)
        y = wp.clamp(wp.dot(at, light.up) / wp.dot(light.up, light.up), -1.0, 1.0)
        return wp.normalize(offset + x * light.right + y * light.up)
    aside = wp.dot(offset, way) * way - offset
    away = wp.length(aside)
    if away > light.radius:
        aside = (light.radius / away) * aside
    return wp.normalize(offset + aside)


@wp.func
def solid_angle_of_triangle(a: wp.vec3, b: wp.vec3, c: wp.vec3, volume: float) -> float:
    """Of a triangle as seen from 0, ``volume`` its corners' triple product: A. van Oosterom, J. Strackee, "The solid
    angle of a plane triangle" (1983)."""
    la, lb, lc = wp.length(a), wp.length(b), wp.length(c)
    return 2.0 * wp.atan2(volume, la * lb * lc + wp.dot(a, b) * lc + wp.dot(b, c) * la + wp.dot(c, a) * lb)


@wp.func
def solid_angle(light: ShapedLightRecord, offset: wp.vec3) -> float:
    """The solid angle that a sphere or a rectangle is seen under."""
    distance = wp.length(offset)
    if light.kind == RECTANGLE:
        middle, right, up = offset / distance, light.right / distance, light.up / distance
        # From the sides, not the corners: those of a small rectangle are too much alike.
        volume = 4.0 * wp.abs(wp.dot(middle, wp.cross(right, up)))
        a, b, c, d = middle - right - up, middle + right - up, middle + right + up, middle - right + up
        return solid_angle_of_triangle(a, b, c, volume) + solid_angle_of_triangle(a, c, d, volume)
    sine_squared = wp.min((light.radius / distance) * (light.radius / distance), 1.0)
    return wp.TAU * sine_squared / (1.0 + wp.sqrt(1.0 - sine_squared))
