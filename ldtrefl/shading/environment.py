"""The environment: what a ray sees that hits nothing."""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.bilinear import bilinear_blend, neighbours_clamped, neighbours_repeating
from ldtrefl.shading.textures import decoded_color
from ldtrefl.world.environment_frame import NEAR_X
from ldtrefl.world.records import LightingRecord

GLARE_REACH = wp.constant(900.0)
"""Squared radius of the sun's glare, in those of its disc: eight degrees, where it has faded away."""


@wp.func
def environment_radiance(lighting: LightingRecord, direction: wp.vec3) -> wp.vec3:
    """The radiance that a ray of this unit direction sees if it hits nothing."""
    height = wp.dot(direction, lighting.up)
    if lighting.image_size[0] == 0:
        blend = 0.5 + 0.5 * height
        return blend * lighting.sky + (1.0 - blend) * lighting.ground
    return environment_image(lighting, direction, height)


@wp.func
def environment_pixel(lighting: LightingRecord, row: int, column: int) -> wp.vec3:
    """A pixel of the environment's picture, linear."""
    if lighting.image_bytes.shape[0] > 0:
        return decoded_color(lighting.image_bytes[row, column], lighting.decoded)
    return lighting.image[row, column]


@wp.func
def environment_image(lighting: LightingRecord, direction: wp.vec3, height: float) -> wp.vec3:
    """The equirectangular picture in a unit direction, and the sun's disc before it: ``up`` is at the top row,
    ``height`` is the cosine with it. For up = +z the middle column is +x, and columns run clockwise seen from above;
    before it is turned. The sun's disc has a glare, as every lens and eye makes it, that falls with the cube of the
    angle (J. J. Vos, T. J. T. P. van den Berg, CIE 135/1, 1999, of small angles; a tenth of what the eye's is)."""
    reference = wp.vec3(1.0, 0.0, 0.0)
    if wp.abs(lighting.up[0]) > NEAR_X:
        reference = wp.vec3(0.0, 1.0, 0.0)
    ahead = wp.normalize(reference - wp.dot(reference, lighting.up) * lighting.up)
    left = wp.cross(lighting.up, ahead)
    longitude = wp.atan2(wp.dot(direction, left), wp.dot(direction, ahead))
    across = 0.5 - longitude / wp.TAU + lighting.turn
    across = wp.where(across > 1.0, across - 1.0, across)
    x = across * float(lighting.image_size[1]) - 0.5
    y = wp.acos(wp.clamp(height, -1.0, 1.0)) / wp.PI * float(lighting.image_size[0]) - 0.5
    columns, rows = neighbours_repeating(x, lighting.image_size[1]), neighbours_clamped(y, lighting.image_size[0])
    seen = lighting.strength * bilinear_blend(
        columns,
        rows,
        environment_pixel(lighting, rows.before, columns.before),
        environment_pixel(lighting, rows.before, columns.after),
        environment_pixel(lighting, rows.after, columns.before),
        environment_pixel(lighting, rows.after, columns.after),
    )
    away = wp.length_sq(direction - lighting.sun)
    if away < GLARE_REACH * lighting.sun_size and height > 0.0:
        ratio = wp.min(lighting.sun_size / away, 1.0)
        seen += ratio * wp.sqrt(ratio) * lighting.sun_radiance
    return seen
