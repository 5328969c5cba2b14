"""Light that needs several rays from each point: of spheres, rectangles and spot lights; and ambient occlusion.

Of a light without shadows the closed form is known (``form_factors.py``). It is multiplied by the share of the light
that is seen, by samples that are weighed as they would light the surface: E. Heitz, S. Hill, M. McGuire, "Combining
analytic direct illumination and stochastic shadows" (2018). So only penumbras have any grain.

What rough surfaces mirror of a light is what they would mirror of its point that is nearest to the mirrored direction,
dimmed as if the light widened the highlight; a smooth one so shows the light's shape in its own radiance. The share of
the light that is seen is taken to be the same. A distant light is mirrored with the picture that it is part of.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import warp as wp

from ldtrefl.geometry.vectors import from_to
from ldtrefl.shading.finish import Finish
from ldtrefl.shading.form_factors import rectangle_form_factor, sphere_form_factor
from ldtrefl.shading.highlights import highlights, wide_highlights
from ldtrefl.shading.light_pattern import pattern_point, pattern_shift
from ldtrefl.shading.light_samples import BEFORE_LIGHT, LightSample, sample_ambient, sample_light
from ldtrefl.shading.light_shapes import nearest_in_light, solid_angle
from ldtrefl.shading.radiance_limit import SMALLEST_SQUARE, at_most_largest
from ldtrefl.shading.specular import mirrored
from ldtrefl.shading.surface import Surface
from ldtrefl.world.look_records import Looks
from ldtrefl.world.records import RECTANGLE, SPOT, LightingRecord, ObjectRecord, ShapedLightRecord
from ldtrefl.world.shading_features import ShadingFeatures
from ldtrefl.world.top_level import TopLevel


@wp.struct
class Lit:
    """What light makes of a surface."""

    ambient: float  # share of ambient light that nothing close holds off
    scattered: wp.vec3  # radiance leaving a white diffuse surface
    mirrored: wp.vec3  # radiance that microfacets mirror


@wp.func
def way_to(light: ShapedLightRecord, position: wp.vec3d) -> wp.vec3:
    """The way from a surface to the middle of a light; of a distant one, in distances of its middle."""
    if light.distant != 0:
        return wp.vec3(light.position)
    return from_to(position, light.position)


@wp.func
def spot_share(light: ShapedLightRecord, towards: wp.vec3) -> float:
    """How much of a spot light's intensity is left in a direction, 0 to 1: glTF, KHR_lights_punctual."""
    share = wp.clamp(light.cone[0] * -wp.dot(light.axis, towards) + light.cone[1], 0.0, 1.0)
    return share * share


@wp.func
def unshadowed(light: ShapedLightRecord, offset: wp.vec3, normal: wp.vec3) -> float:
    """What a white diffuse surface scatters of a light whose middle is at ``offset``, over the light's radiance."""
    if light.kind == RECTANGLE:
        return rectangle_form_factor(offset, light.right, light.up, normal)
    square = wp.dot(offset, offset)
    towards = wp.normalize(offset)
    cosine = wp.dot(normal, towards)
    if light.kind == SPOT:
        return wp.max(cosine, 0.0) * spot_share(light, towards) / wp.max(square, SMALLEST_SQUARE)
    if square <= light.radius * light.radius:
        return 0.0
    return sphere_form_factor(cosine, light.radius * light.radius / square)


@wp.func
def mirrored_light(finishes: wp.array(dtype=Finish), light: ShapedLightRecord, offset: wp.vec3) -> wp.vec3:
    """What the layers of a surface, the first finish, mirror of a light, over the light's radiance. Layers that send
    rays see its shape by these."""
    towards = wp.normalize(offset)
    if light.kind == SPOT:
        return (
            spot_share(light, towards) / wp.max(wp.dot(offset, offset), SMALLEST_SQUARE) * highlights(finishes, towards)
        )
    in_base = nearest_in_light(light, offset, mirrored(finishes[0].view, finishes[0].normal))
    in_coat = nearest_in_light(light, offset, mirrored(finishes[0].view, finishes[0].coat_normal))
    covers = solid_angle(light, offset) / wp.PI
    seen_by_rays = wp.where(light.visible != 0, finishes[0].rays, 0)
    return covers * wide_highlights(finishes, in_base, in_coat, 0.25 * covers, seen_by_rays)


def make_share_seen(share_lit: Callable[..., float]) -> Callable[..., float]:
    """``share_seen(views, objects, top, lighting, looks, surface, normal, i, offset, pixel)``: how much of shaped light
    ``i``, at ``offset``, a surface sees, or of ambient light if that is -1; from 0 to 1. ``share_lit`` is that of
    :func:`make_direct_radiance`; it is called in one place, as compilers copy it to each."""

    @wp.func
    def share_seen(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        surface: Surface,
        normal: wp.vec3,
        i: int,
        offset: wp.vec3,
        pixel: wp.vec2i,
    ) -> float:
        count = lighting.occlusion_samples
        if i >= 0:
            count = lighting.shaped[i].samples
        shift = pattern_shift(lighting.noise, pixel, i + 1)
        total, seen = float(0.0), float(0.0)
        for k in range(count):
            point = pattern_point(k, count, shift)
            sample = LightSample()
            if i >= 0:
                sample = sample_light(lighting.shaped[i], offset, normal, point)
            else:
                sample = sample_ambient(normal, lighting.occlusion_distance, point)
            if sample.weight > 0.0:
                distance = BEFORE_LIGHT * sample.distance
                if i >= 0:
                    distance = wp.where(lighting.shaped[i].distant != 0, wp.inf, distance)
                total += sample.weight
                seen += sample.weight * share_lit(views, objects, top, looks, surface, sample.towards, distance)
        return wp.where(total > 0.0, seen / total, 0.0)

    return share_seen


def make_soft_light(share_lit: Callable[..., float], features: ShadingFeatures) -> Callable[..., Lit]:
    """``soft_light(views, objects, top, lighting, looks, surface, normal, finishes, pixel)``: what shaped lights make
    of a surface, and the share of ambient light; the first of ``finishes`` counts only if there are looks."""
    with_looks, share_seen = wp.constant(features.looks), make_share_seen(share_lit)

    @wp.func
    def soft_light(
        views: Any,
        objects: wp.array(dtype=ObjectRecord),
        top: TopLevel,
        lighting: LightingRecord,
        looks: Looks,
        surface: Surface,
        normal: wp.vec3,
        finishes: wp.array(dtype=Finish),
        pixel: wp.vec2i,
    ) -> Lit:
        lit = Lit()
        lit.ambient = 1.0
        first = wp.where(lighting.occlusion_samples > 0, -1, 0)
        for i in range(first, lighting.shaped.shape[0]):
            offset = wp.vec3(0.0)
            factor = float(1.0)
            if i >= 0:
                offset = way_to(lighting.shaped[i], surface.position)
                factor = unshadowed(lighting.shaped[i], offset, normal)
            share = float(1.0)
            if factor > 0.0 and (i < 0 or lighting.shadows != 0):
                share = share_seen(views, objects, top, lighting, looks, surface, normal, i, offset, pixel)
            if i < 0:
                lit.ambient = share
            elif factor > 0.0 and share > 0.0:
                radiance = share * lighting.shaped[i].radiance
                lit.scattered += at_most_largest(factor * radiance)
                if with_looks and lighting.shaped[i].distant == 0:
                    mirror = mirrored_light(finishes, lighting.shaped[i], offset)
                    lit.mirrored += at_most_largest(wp.cw_mul(mirror, radiance))
        return lit

    return soft_light
