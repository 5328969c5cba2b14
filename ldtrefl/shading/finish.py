"""What a look makes of a surface: its colours, its normal, and how it scatters light, in C++ (``finish.h``).

The model is glTF's metallic-roughness. What is cut out by alpha, or seen from behind of what is single-sided, is not
there: rays go straight on. Shadows are those of both sides: what a surface keeps light from does not depend on its
winding, and light does not come in through walls whose outsides are not modelled.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.native_sources import native_body
from ldtrefl.shading.surface import Surface, part_of
from ldtrefl.shading.surfaces import Sighting
from ldtrefl.shading.textures import PICTURE_CONSTANTS
from ldtrefl.world import look_records
from ldtrefl.world.environment_frame import NEAR_X
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.reflectance_table import COLUMNS as TABLE_COLUMNS
from ldtrefl.world.reflectance_table import ROWS as TABLE_ROWS

LEAST_TILT = 0.01
"""The least cosine of a mapped normal with the facet's, and with the way to the viewer."""

LEAST_SHARE = 1.0e-3
"""The least share that microfacets are taken to reflect in all, which is divided by."""

LEAST_ROUGHNESS = 0.05
"""Lights are mirrored as if surfaces were at least as rough: the highlight of a point, or of a single direction, would
be infinitely bright on a smooth one. This is 0.3 degrees wide, and up to 50,000 times as bright as a white surface."""

COAT = 0.04
"""Reflectance of a varnish at normal incidence: its index of refraction is 1.5 (KHR_materials_clearcoat)."""


@wp.struct
class Finish:
    """What shading needs of a surface with a look, beside ``Surface``. Its layers are the base, and a varnish over it;
    what they reflect is after what the varnish takes away, and with multiple scattering."""

    ambient: float  # share of the ambient light that arrives
    highlights: int  # layers that mirror lights: 0, the base, or both
    rays: int  # layers that send rays: 1 the base, 2 the varnish, or both
    normal: wp.vec3  # shading normal of the base
    coat_normal: wp.vec3  # and of the varnish, which normal maps do not bend
    view: wp.vec3  # unit, from the eye
    low: wp.vec3  # reflectance of the base at normal incidence,
    high: wp.vec3  # and along the surface
    alpha: float  # roughness of its highlights, squared
    coat_low: wp.vec3
    coat_high: wp.vec3
    coat_alpha: float


LOOK_CONSTANTS = (
    *("MASK", "BLEND", "SLOTS", "BASE", "METALLIC_ROUGHNESS", "NORMAL", "OCCLUSION", "EMISSION"),
    *("SPECULAR", "SPECULAR_COLOR", "CLEARCOAT", "CLEARCOAT_ROUGHNESS"),
)
"""Constants of ``look_records.py`` that the C++ uses."""

CONSTANTS: dict[str, float | int] = {
    "LEAST_TILT": LEAST_TILT,
    **PICTURE_CONSTANTS,
    "LEAST_SHARE": LEAST_SHARE,
    "LEAST_ROUGHNESS": LEAST_ROUGHNESS,
    "COAT": COAT,
    "NEAR_X": float(NEAR_X),
    "PI": math.pi,
    "TABLE_ROWS": TABLE_ROWS,
    "TABLE_COLUMNS": TABLE_COLUMNS,
    **{name: getattr(look_records, name) for name in LOOK_CONSTANTS},
}
FILES = ("shading/pictures.h", "shading/finish.h")

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
"""
PICTURE = """
// A texture with its picture.
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
    made.mip_floats = (const float*)look.mip_texels.data + 3LL * of.first_mip;
    made.mip_bytes = (const unsigned char*)look.mip_bytes.data + 3LL * of.first_mip;
    made.mip_alpha = look.mip_alpha.data + of.first_mip_alpha;
    made.decoded = looks.decoded.data;
    return made;
};
"""
TEXTURES = """
// Read the textures, of which v = 0 is at the top row.
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
    if (!IS_FILTERED) {
        texels[slot] = Finishes::sample(picture_of(number), u, v);
        continue;
    }
    float change[4];
    for (int i = 0; i < 4; ++i) {
        const int axis = i / 2 * 2, c = i % 2;
        change[i] = sighting.spread[axis] * (uv[2 + c] - uv[c]) + sighting.spread[axis + 1] * (uv[4 + c] - uv[c]);
    }
    texels[slot] = Finishes::mean_over(picture_of(number), u, v, change);
    if (slot == BASE && material.alpha_mode == MASK)  // of a mean, what is small would be cut away
        texels[slot].w = Finishes::sample(picture_of(number), u, v).w;
}
Three base = Finishes::product(three(material.base), color_of(texels[BASE]));
float alpha = material.alpha * texels[BASE].w;
if (look.colors.shape[0])
    for (int i = 0; i < 4; ++i) {
        float mean = 0.0f;
        for (int c = 0; c < 3; ++c) mean += weight[c] * look.colors.data[(*face)[c]][i];
        (i < 3 ? (&base.x)[i] : alpha) *= mean;
    }
float coverage = Finishes::covered(material.alpha_mode, material.alpha_cutoff, alpha);
if (material.hides_back && surface.is_back && !(look.has_image.shape[0] && look.has_image.data[sighting.triangle]))
    coverage = 0.0f;
"""
BEND = """
// Let the normal map bend the normal.
const Three smooth = three(surface.normal);
Three normal = smooth;
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
LAY = """
// Lay the surface's layers.
Finishes::Model model;
model.base = base;
model.emission = Finishes::product(three(material.emission), color_of(texels[EMISSION]));
model.specular_color = Finishes::product(three(material.specular_color), color_of(texels[SPECULAR_COLOR]));
model.mirror = three(material.mirror);
model.metallic = Finishes::clamped(material.metallic * texels[METALLIC_ROUGHNESS].z, 0.0f, 1.0f);
model.roughness = Finishes::clamped(material.roughness * texels[METALLIC_ROUGHNESS].y, 0.0f, 1.0f);
model.dielectric = material.dielectric;
model.specular = material.specular * texels[SPECULAR].w;
model.clearcoat = material.clearcoat * texels[CLEARCOAT].x;
model.coat_roughness = Finishes::clamped(material.clearcoat_roughness * texels[CLEARCOAT_ROUGHNESS].y, 0.0f, 1.0f);
model.has_mirror = material.has_mirror;
model.has_fresnel = material.has_fresnel;
model.is_unlit = material.is_unlit;
model.threshold = looks.threshold;
model.rough_limit = looks.rough_limit;
const Three view = three(sighting.view);
Finishes::Layers layers;
Finishes::lay(
    model, (const float*)looks.shares.data, -Finishes::dot(normal, view), -Finishes::dot(smooth, view), layers
);
if (coverage < 1.0f) Finishes::let_through(coverage, layers);
"""
HAZE = """
// Add what is reflected of the environment in place of rays.
Finishes::Environment around;
around.up = three(lighting.up);
around.sky = three(lighting.sky);
around.ground = three(lighting.ground);
around.sharp.width = lighting.image_size[1];
around.sharp.height = lighting.image_size[0];
around.sharp.stored = lighting.image_bytes.shape[0] > 0 ? SRGB_BYTES : LINEAR_FLOATS;
around.sharp.wrap_u = REPEAT;
around.sharp.wrap_v = CLAMP;
around.sharp.is_nearest = 0;
for (int i = 0; i < 3; ++i) {
    around.sharp.across[i] = i == 0;
    around.sharp.down[i] = i == 1;
}
around.sharp.floats = (const float*)lighting.image.data;
around.sharp.bytes = (const unsigned char*)lighting.image_bytes.data;
around.sharp.alpha = nullptr;
around.sharp.decoded = looks.decoded.data;
around.turn = lighting.turn;
around.strength = lighting.strength;
around.rough = (const float*)looks.environment.data;
around.levels = looks.environment.shape[0];
around.rows = looks.environment.shape[1];
around.columns = looks.environment.shape[2];
for (int part = 0; part < 3; ++part) {
    const Three share = part == 0 ? layers.haze : part == 1 ? layers.coat_haze : layers.behind;
    if (!(Finishes::largest(share) > 0.0f)) continue;
    const Three leaving =
        part == 2 ? view : Finishes::mirrored(view, part == 1 ? smooth : normal, three(surface.facet));
    const float roughness = part == 0 ? model.roughness : part == 1 ? model.coat_roughness : 0.0f;
    const float cosine = part == 0 ? layers.cosine : part == 1 ? layers.coat_cosine : 1.0f;
    const Three light = Finishes::hazy(around, leaving, roughness, cosine);
    layers.emission = Finishes::sum(layers.emission, Finishes::product(share, light));
}
"""
STORE = """
auto& finish = finishes.data[0];
finish.ambient = 1.0f + material.occlusion_strength * (texels[OCCLUSION].x - 1.0f);
finish.normal = coverage > 0.0f ? vec3(normal) : wp::vec3(0.0f);  // no light is asked for what is not there
finish.coat_normal = vec3(smooth);
finish.view = sighting.view;
finish.low = material.has_highlights ? vec3(layers.low) : wp::vec3(0.0f);
finish.high = material.has_highlights ? vec3(layers.high) : wp::vec3(0.0f);
finish.coat_low = vec3(layers.coat_low);
finish.coat_high = vec3(layers.coat_high);
finish.rays = layers.rays;
finish.highlights = model.clearcoat > 0.0f ? 2 : material.has_highlights && Finishes::largest(layers.high) > 0.0f;
const float rough = Finishes::larger(model.roughness, LEAST_ROUGHNESS);
const float coat_rough = Finishes::larger(model.coat_roughness, LEAST_ROUGHNESS);
finish.alpha = rough * rough;
finish.coat_alpha = coat_rough * coat_rough;
surface.normal = vec3(layers.is_by_coat ? smooth : normal);
surface.albedo = vec3(layers.diffuse);
surface.emission = vec3(layers.emission);
surface.mirror = vec3(layers.mirror);
surface.goes_through = layers.goes_through;
"""


FIND = """
const auto& record = objects.data[k];
const auto& look = looks.records.data[record.look];
const auto& material = look.materials.data[part];
if (material.alpha_mode != MASK && material.alpha_mode != BLEND) return 1.0f;
"""
COVER = """
const auto* face = record.faces.data + triangle;
const float weight[3] = {1.0f - u - v, u, v};
float alpha = material.alpha;
const int number = material.slots > BASE ? material.textures[BASE] : -1;
if (number >= 0) {
    const auto* uvs = look.textures.data[number].uv_set ? look.second_uvs.data : look.uvs.data;
    float s = 0.0f, t = 0.0f;
    for (int c = 0; c < 3; ++c) {
        s += weight[c] * uvs[(*face)[c]][0];
        t += weight[c] * (1.0f - uvs[(*face)[c]][1]);
    }
    alpha *= Finishes::sample(picture_of(number), s, t).w;
}
if (look.colors.shape[0]) {
    float mean = 0.0f;
    for (int c = 0; c < 3; ++c) mean += weight[c] * look.colors.data[(*face)[c]][3];
    alpha *= mean;
}
return Finishes::covered(material.alpha_mode, material.alpha_cutoff, alpha);
"""


@wp.func_native(native_body(CONSTANTS | {"MOST_PROBES": 1}, FILES, FIND + PICTURE + COVER))
def coverage_of_part(
    objects: wp.array(dtype=ObjectRecord), looks: Looks, k: int, part: int, triangle: int, u: float, v: float
) -> wp.float32:
    """How much of the light that passes a triangle of object ``k``, which has a look, is stopped there by its alpha."""
    ...


@launch.once
def finishing(probes: int) -> Callable[..., None]:
    """``finish_surface(objects, looks, lighting, sightings, lane, surfaces, finishes)``: set the colours, the
    reflectance and the normal of a lane's surface that has a look; and the first finish, which is what else shading
    needs of it. The surface's normal is then that which rays are mirrored at; what it shows of the environment in place
    of rays is added to its emission.

    Textures are read at its point, or with ``probes`` above 0 over its spread, in so many probes at most.
    """
    constants = CONSTANTS | {"IS_FILTERED": probes > 0, "MOST_PROBES": max(probes, 1)}

    @wp.func_native(native_body(constants, FILES, READ + PICTURE + TEXTURES + BEND + LAY + HAZE + STORE))
    def finish_part(
        objects: wp.array(dtype=ObjectRecord),
        looks: Looks,
        lighting: LightingRecord,
        part: int,
        sightings: wp.array(dtype=Sighting),
        lane: int,
        surfaces: wp.array(dtype=Surface),
        finishes: wp.array(dtype=Finish),
    ):
        """Do so for a part of the object."""
        ...

    @wp.func
    def finish_surface(
        objects: wp.array(dtype=ObjectRecord),
        looks: Looks,
        lighting: LightingRecord,
        sightings: wp.array(dtype=Sighting),
        lane: int,
        surfaces: wp.array(dtype=Surface),
        finishes: wp.array(dtype=Finish),
    ):
        part = part_of(objects, sightings[lane].object, sightings[lane].triangle)
        finish_part(objects, looks, lighting, part, sightings, lane, surfaces, finishes)

    return finish_surface
