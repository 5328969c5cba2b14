"""What a look makes of a surface: its colours, its normal, and how it scatters light, in C++ (``finish.h``).

The model is glTF's metallic-roughness. Surfaces are shaded from both sides, ``double_sided`` or not: to leave out a
side would show the inside of what is meant to be solid through any hole, and rays come from everywhere.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body
from ldtrefl.shading.surface import Surface, part_of
from ldtrefl.shading.surfaces import Sighting
from ldtrefl.world import look_records
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import ObjectRecord

LEAST_TILT = 0.01
"""The least cosine of a mapped normal with the facet's, and with the way to the viewer."""

FARTHEST = 1.0e6
"""Texture coordinates beyond this count as this: float32 tells no texels apart there."""

BYTE = 1.0 / 255.0
"""What the smallest step of a byte is worth."""


@wp.struct
class Finish:
    """What shading needs of a surface with a look, beside ``Surface``."""

    ambient: float  # share of the ambient light that arrives


CONSTANTS: dict[str, float | int] = {
    "LEAST_TILT": LEAST_TILT,
    "FARTHEST": FARTHEST,
    "BYTE": BYTE,
    **{name: getattr(look_records, name) for name in ("CLAMP", "MIRROR", "LINEAR_FLOATS", "SRGB_BYTES", "SLOTS")},
    **{name: getattr(look_records, name) for name in ("BASE", "NORMAL", "OCCLUSION", "EMISSION")},
}
FILES = ("device/vectors.h", "shading/finish.h")

READ = """
using Three = Finishes::Three;
using Texel = Finishes::Texel;
const auto& sighting = sightings.data[lane];
const auto& record = objects.data[sighting.object];
const auto& look = looks.records.data[record.look];
const auto& material = look.materials.data[part];
auto& surface = surfaces.data[lane];
const auto three = [](const auto& a) { return Three{a[0], a[1], a[2]}; };
const auto vec3 = [](const Three& a) { return wp::vec3(a.x, a.y, a.z); };
const auto color_of = [](const Texel& a) { return Three{a.x, a.y, a.z}; };
const auto* face = record.faces.data + sighting.triangle;
const float weight[3] = {1.0f - sighting.u - sighting.v, sighting.u, sighting.v};

// Read the textures, of which v = 0 is at the top row.
const auto picture_of = [&](int number) {
    const auto& of = look.textures.data[number];
    Finishes::Picture made;
    made.width = of.width;
    made.height = of.height;
    made.stored = of.stored;
    made.wrap_u = of.wrap[0];
    made.wrap_v = of.wrap[1];
    made.is_nearest = of.is_nearest;
    for (int i = 0; i < 3; ++i) {
        made.across[i] = of.across[i];
        made.down[i] = of.down[i];
    }
    made.floats = (const float*)look.texels.data + 3LL * of.first;
    made.bytes = (const unsigned char*)look.texel_bytes.data + 3LL * of.first;
    made.alpha = of.first_alpha < 0 ? nullptr : look.texel_alpha.data + of.first_alpha;
    made.decoded = looks.decoded.data;
    return made;
};
const auto uvs_of = [&](int number, float* uv) {
    const auto* uvs = look.textures.data[number].uv_set ? look.second_uvs.data : look.uvs.data;
    for (int c = 0; c < 3; ++c) {
        uv[2 * c] = uvs[(*face)[c]][0];
        uv[2 * c + 1] = 1.0f - uvs[(*face)[c]][1];
    }
};
Texel texels[SLOTS];
for (int slot = 0; slot < SLOTS; ++slot) {
    texels[slot] = {1.0f, 1.0f, 1.0f, 1.0f};
    const int number = slot < material.slots ? material.textures[slot] : -1;
    if (number < 0) continue;
    float uv[6];
    uvs_of(number, uv);
    const float u = weight[0] * uv[0] + weight[1] * uv[2] + weight[2] * uv[4];
    const float v = weight[0] * uv[1] + weight[1] * uv[3] + weight[2] * uv[5];
    texels[slot] = Finishes::sample(picture_of(number), u, v);
}
Three base = Finishes::product(three(material.base), color_of(texels[BASE]));
if (look.colors.shape[0])
    for (int i = 0; i < 3; ++i) {
        float mean = 0.0f;
        for (int c = 0; c < 3; ++c) mean += weight[c] * look.colors.data[(*face)[c]][i];
        (&base.x)[i] *= mean;
    }
"""
BEND = """
// Let the normal map bend the normal.
Three normal = three(surface.normal);
if (material.slots > NORMAL && material.textures[NORMAL] >= 0) {
    Three right = {0.0f, 0.0f, 0.0f};
    float sign = 0.0f;
    if (look.tangents.shape[0])
        for (int c = 0; c < 3; ++c) {
            const auto& stored = look.tangents.data[(*face)[c]];
            right = Finishes::sum(right, Finishes::scaled(weight[c], {stored[0], stored[1], stored[2]}));
            sign += weight[c] * stored[3];
        }
    if (sign == 0.0f) {
        Three corner[3];
        float uv[6];
        for (int c = 0; c < 3; ++c) corner[c] = three(record.vertices.data[(*face)[c]]);
        uvs_of(material.textures[NORMAL], uv);
        right = Finishes::picture_right(picture_of(material.textures[NORMAL]), corner, uv, sign);
    }
    sign = sign < 0.0f ? -1.0f : 1.0f;
    right = Finishes::unit(right);
    double turned[3];
    for (int row = 0; row < 3; ++row) {
        const auto* m = record.device_from_unit.data[row];
        turned[row] = m[0] * right.x + m[1] * right.y + m[2] * right.z;
    }
    const double length = sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2]);
    if (length > 0.0) right = {(float)(turned[0] / length), (float)(turned[1] / length), (float)(turned[2] / length)};
    const float side = surface.is_back ? -1.0f : 1.0f;
    normal = Finishes::mapped_normal(normal, right, sign, side, texels[NORMAL], material.normal_scale);
    normal = Finishes::on_facets_side(normal, three(surface.facet), Finishes::scaled(-1.0f, three(sighting.view)));
}
"""
STORE = """
auto& finish = finishes.data[0];
finish.ambient = 1.0f + material.occlusion_strength * (texels[OCCLUSION].x - 1.0f);
surface.normal = vec3(normal);
surface.albedo = vec3(material.is_unlit ? Three{0.0f, 0.0f, 0.0f} : base);
surface.emission = vec3(
    material.is_unlit ? base : Finishes::product(three(material.emission), color_of(texels[EMISSION]))
);
"""


@wp.func_native(native_body(CONSTANTS, FILES, READ + BEND + STORE))
def finish_part(
    objects: wp.array(dtype=ObjectRecord),
    looks: Looks,
    part: int,
    sightings: wp.array(dtype=Sighting),
    lane: int,
    surfaces: wp.array(dtype=Surface),
    finishes: wp.array(dtype=Finish),
):
    """Set the colours and the normal of a lane's surface, on a part of an object with a look; and the first finish."""
    ...


@wp.func
def finish_surface(
    objects: wp.array(dtype=ObjectRecord),
    looks: Looks,
    sightings: wp.array(dtype=Sighting),
    lane: int,
    surfaces: wp.array(dtype=Surface),
) -> Finish:
    """Set the colours and the normal of a lane's surface that has a look; what else shading needs of it."""
    memory = wp.zeros(shape=1, dtype=Finish)
    finishes = wp.array(ptr=memory.ptr, shape=(1,), dtype=Finish)
    part = part_of(objects, sightings[lane].object, sightings[lane].triangle)
    finish_part(objects, looks, part, sightings, lane, surfaces, finishes)
    return finishes[0]
