"""Lights in rough mirrors, in C++ (``highlights.h``).

Microfacets have GGX's distribution, height-correlated Smith masking and Schlick's Fresnel reflectance (glTF 2.0,
appendix B; E. Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", 2014).
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body
from ldtrefl.shading.finish import Finish

LEAST_COSINE = 1.0e-4
"""The least cosine with the way to the viewer: a smooth surface's normal may face away from who sees its facet."""

CONSTANTS: dict[str, float | int] = {"LEAST_COSINE": LEAST_COSINE}
FILES = ("shading/highlights.h",)

MIRROR_LIGHT = """
const auto& finish = finishes.data[0];
const auto three = [](const auto& a) { return Highlights::Three{a[0], a[1], a[2]}; };
const Highlights::Three to_viewer = {-finish.view[0], -finish.view[1], -finish.view[2]};
wp::vec3 total(0.0f);
for (int i = 0; i < finish.highlights; ++i) {
    const auto& low = i ? finish.coat_low : finish.low;
    const auto& high = i ? finish.coat_high : finish.high;
    const auto& normal = i ? finish.coat_normal : finish.normal;
    float grazing = 0.0f;
    const float alpha = i ? finish.coat_alpha : finish.alpha;
    const float share = Highlights::mirrored(alpha, three(normal), three(towards), to_viewer, grazing);
    for (int c = 0; c < 3; ++c) total[c] += share * (low[c] + grazing * (high[c] - low[c]));
}
return total;
"""


MIRROR_WIDE_LIGHT = """
const auto& finish = finishes.data[0];
const auto three = [](const auto& a) { return Highlights::Three{a[0], a[1], a[2]}; };
const Highlights::Three to_viewer = {-finish.view[0], -finish.view[1], -finish.view[2]};
wp::vec3 total(0.0f);
for (int i = 0; i < finish.highlights; ++i) {
    if (left_out >> i & 1) continue;
    const auto& low = i ? finish.coat_low : finish.low;
    const auto& high = i ? finish.coat_high : finish.high;
    const auto& normal = i ? finish.coat_normal : finish.normal;
    float grazing = 0.0f;
    const float alpha = i ? finish.coat_alpha : finish.alpha, square = alpha * alpha;
    const float once = Highlights::mirrored(alpha, three(normal), three(i ? in_coat : in_base), to_viewer, grazing);
    const float share = once * square / (square + spread);
    for (int c = 0; c < 3; ++c) total[c] += share * (low[c] + grazing * (high[c] - low[c]));
}
return total;
"""


@wp.func_native(native_body(CONSTANTS, FILES, MIRROR_LIGHT))
def highlights(finishes: wp.array(dtype=Finish), towards: wp.vec3) -> wp.vec3:
    """What the layers of a surface, the first finish, mirror of a light in unit direction ``towards``, in units of what
    a white surface that faces the light scatters."""
    ...


@wp.func_native(native_body(CONSTANTS, FILES, MIRROR_WIDE_LIGHT))
def wide_highlights(
    finishes: wp.array(dtype=Finish), in_base: wp.vec3, in_coat: wp.vec3, spread: float, left_out: int
) -> wp.vec3:
    """The same of a light that is wide, by its points in unit directions ``in_base``, which is nearest to what the base
    mirrors, and ``in_coat``.

    A light of solid angle W makes a highlight of alpha^2 one of alpha^2 + W / 4 pi, of the same energy (after B. Karis,
    "Real Shading in Unreal Engine 4", 2013). W / 4 pi is ``spread``: a smooth surface then shows the light in its own
    radiance, whatever its shape. Layers whose bits, 1 for the base and 2 for the varnish, are in ``left_out`` add
    nothing.
    """
    ...
