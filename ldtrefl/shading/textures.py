"""The textures of an object, read bilinearly.

Pixels are linear floats, or 8-bit sRGB values that a table decodes.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.geometry.bilinear import bilinear_blend, neighbours_repeating
from ldtrefl.world.records import ObjectRecord


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
    """The linear colour of an object's texture at ``uv``. Pictures repeat; v = 0 is at the bottom row.

    ``place`` is the texture's first texel, width, height, and 1 if its texels are bytes.
    """
    x = (uv[0] - wp.floor(uv[0])) * float(place[1]) - 0.5
    y = (1.0 - (uv[1] - wp.floor(uv[1]))) * float(place[2]) - 0.5
    columns, rows = neighbours_repeating(x, place[1]), neighbours_repeating(y, place[2])
    upper, lower = place[0] + rows.before * place[1], place[0] + rows.after * place[1]
    return bilinear_blend(
        columns,
        rows,
        texel(objects, index, place[3], upper + columns.before),
        texel(objects, index, place[3], upper + columns.after),
        texel(objects, index, place[3], lower + columns.before),
        texel(objects, index, place[3], lower + columns.after),
    )
