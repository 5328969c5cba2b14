"""The textures of an object, read bilinearly, or as the mean over what a pixel covers, in C++ (``pictures.h``).

Pixels are linear floats, or 8-bit sRGB values that a table decodes.

What a pixel covers of a texture is an ellipse (P. Heckbert, "Fundamentals of Texture Mapping and Image Warping", 1989).
It is covered by *probes* in a row along its longer axis, each as wide as the shorter one, which count most in the
middle. A probe is read from the two mip maps (``world/mip_maps.py``) whose texels are next smaller and next larger,
each bilinearly, and blended (L. Williams, "Pyramidal Parametrics", 1983). With one probe it is as wide as the longer
axis. ``tools/texture_filtering.py`` measures how near this is to the mean of very many samples.
"""

from __future__ import annotations

from collections.abc import Callable

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.native_sources import native_body
from ldtrefl.geometry.bilinear import bilinear_blend, neighbours_repeating
from ldtrefl.world import look_records
from ldtrefl.world.records import ObjectRecord

FARTHEST = 1.0e6
"""Texture coordinates beyond this count as this: float32 tells no texels apart there."""

BYTE = 1.0 / 255.0
"""What the smallest step of a byte is worth."""

FILTER_WIDTH = 1.837
"""Length of the filter, in pixels. A tent spreads by its length over the root of 24: by 0.375 pixels, as the Gaussian
does that samples are blended by."""

PROBE_WIDTH = 0.75
"""Width of the texels that a probe is read from, in pixels. A texel that is read bilinearly spreads by half of its
width: by 0.375 pixels, too. What probes spread by themselves the row of them need not."""

PROBE_STEP = 1.33
"""From a probe to the next, in such texels. With 1 nothing would be left between them."""

ROUNDING = 1.0e-3
"""By how much an axis may be longer than its probes."""

PICTURE_CONSTANTS: dict[str, float | int] = {
    "FARTHEST": FARTHEST,
    "BYTE": BYTE,
    "PROBE_WIDTH": PROBE_WIDTH,
    "PROBE_STEP": PROBE_STEP,
    "ROUNDING": ROUNDING,
    "FILTER_WIDTH": FILTER_WIDTH,
    **{name: getattr(look_records, name) for name in ("REPEAT", "CLAMP", "MIRROR", "LINEAR_FLOATS", "SRGB_BYTES")},
}
"""Constants that ``pictures.h`` uses, beside ``MOST_PROBES``."""

FILES = ("shading/pictures.h",)

MEAN = """
const auto& record = objects.data[index];
const auto& place = record.part_texture.data[part];
Pictures::Picture of;
of.width = place[1];
of.height = place[2];
of.stored = place[3] ? SRGB_BYTES : LINEAR_FLOATS;
of.wrap_u = of.wrap_v = REPEAT;
of.is_nearest = 0;
of.across[0] = 1.0f;  // v = 0 is at the bottom
of.across[1] = of.across[2] = of.down[0] = 0.0f;
of.down[1] = -1.0f;
of.down[2] = 1.0f;
of.floats = (const float*)record.texels.data + 3LL * place[0];
of.bytes = (const unsigned char*)record.texel_bytes.data + 3LL * place[0];
of.mip_floats = (const float*)record.mip_texels.data + 3LL * record.part_mips.data[part];
of.mip_bytes = (const unsigned char*)record.mip_bytes.data + 3LL * record.part_mips.data[part];
of.alpha = of.mip_alpha = nullptr;
of.decoded = record.decoded.data;
const auto& corners = record.faces.data[triangle];
const auto& a = record.uvs.data[corners[0]];
const auto& b = record.uvs.data[corners[1]];
const auto& c = record.uvs.data[corners[2]];
float at[2], change[4];
for (int i = 0; i < 2; ++i) {
    at[i] = (1.0f - u - v) * a[i] + u * b[i] + v * c[i];
    for (int axis = 0; axis < 2; ++axis)
        change[2 * axis + i] = spread[2 * axis] * (b[i] - a[i]) + spread[2 * axis + 1] * (c[i] - a[i]);
}
const Pictures::Texel mean = Pictures::mean_over(of, at[0], at[1], change);
return wp::vec3(mean.x, mean.y, mean.z);
"""


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


@launch.once
def texture_mean(probes: int) -> Callable[..., wp.vec3]:
    """``mean_of_texture(objects, index, part, triangle, u, v, spread)``: the mean linear colour of the texture of a
    part of an object about barycentrics (u, v) of a triangle, over what a pixel covers, in so many probes at most.
    ``spread`` is by how much u and v change to the pixel to the right, then to that below."""
    constants = PICTURE_CONSTANTS | {"MOST_PROBES": probes}

    @wp.func_native(native_body(constants, FILES, MEAN))
    def mean_of_texture(
        objects: wp.array(dtype=ObjectRecord), index: int, part: int, triangle: int, u: float, v: float, spread: wp.vec4
    ) -> wp.vec3: ...

    return mean_of_texture
