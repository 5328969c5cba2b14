"""Which pixels need more than one sample: those that differ from a neighbour.

Where pixels in a row see the same objects, directly and by all reflections, a pixel differs if its radiance is not half
way between its neighbours': what changes steadily needs one sample. Where they see others an edge runs between them,
and it differs if their radiances do. What differs in nothing but geometry looks the same, and needs no more samples.

Radiances are compared as the eye does: on the scale ``sqrt(L / (1 + L))``, on which 0.5 is 0.58 and 5 is 0.91. It is
done in C++ (``contrast.h``).
"""

from __future__ import annotations

import math

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.native_sources import native_body
from ldtrefl.frame.bounce_hits import FirstHits
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.pixel_order import pixels_in_blocks

WITHIN = 0.06
"""Difference on that scale from the mean of two neighbours that see the same objects, over the root of the samples that
a pixel may have: who asks for many wants small differences to count."""

AT_EDGE = 0.04
"""The same from a neighbour that sees others."""

VARIED = 0.08
"""The same between samples of a pixel."""

CONSTANTS: dict[str, float | int] = {"VARIED": VARIED}
FILES = ("device/vectors.h", "frame/contrast.h")

MARK = """
const float* const row = &radiance.data[begin][0];
const bool has_above = begin > 0, has_below = begin + width < (int)radiance.shape[0];
Contrast::mark_row(row, seen.data + begin, width, has_above, has_below, within, at_edge, marked_out.data + begin);
"""
MARK_GROUP = """
bool varies = false;
for (int i = 1; i < count; ++i)
    varies |= Contrast::are_apart(&radiance.data[count * group][0], &radiance.data[count * group + i][0], VARIED);
marked_out.data[group] = varies;
"""

FACTOR = wp.constant(31)
"""Of the number that stands for the objects that a pixel sees, one after another."""


@launch.kernel
def mix_in_objects(
    first: int,
    # In:
    pixel: wp.array(dtype=wp.int32),
    object: wp.array(dtype=wp.int32),
    # In and out:
    seen: wp.array(dtype=wp.int32),
):
    """Mix the object that one ray ends on into the number of its pixel."""
    i = first + wp.tid()
    seen[pixel[i]] = FACTOR * seen[pixel[i]] + object[i] + 2


@wp.func_native(native_body(CONSTANTS, FILES, MARK))
def mark_row(
    radiance: wp.array(dtype=wp.vec3),
    seen: wp.array(dtype=wp.int32),
    begin: int,
    width: int,
    within: float,
    at_edge: float,
    marked_out: wp.array(dtype=wp.uint8),
):
    """Mark the pixels from ``begin`` on, a row of them, that differ from their neighbours."""
    ...


@wp.func_native(native_body(CONSTANTS, FILES, MARK_GROUP))
def mark_group(radiance: wp.array(dtype=wp.vec3), count: int, group: int, marked_out: wp.array(dtype=wp.uint8)):
    """Mark a group of ``count`` samples if any of them differs from the first."""
    ...


@launch.kernel
def mark_contrast(
    first: int,
    # In:
    width: int,
    radiance: wp.array(dtype=wp.vec3),
    seen: wp.array(dtype=wp.int32),
    within: float,
    at_edge: float,
    # Out:
    marked_out: wp.array(dtype=wp.uint8),
):
    """Mark the pixels of one row that differ from their neighbours."""
    mark_row(radiance, seen, width * (first + wp.tid()), width, within, at_edge, marked_out)


@launch.kernel
def mark_varied(
    first: int,
    # In:
    count: int,
    radiance: wp.array(dtype=wp.vec3),
    # Out:
    marked_out: wp.array(dtype=wp.uint8),
):
    """Mark one group of ``count`` samples if they differ among themselves."""
    mark_group(radiance, count, first + wp.tid(), marked_out)


def objects_seen(gbuffer: GBuffer, hits: FirstHits | None) -> wp.array:
    """(pixels,) int32: a number for what each pixel sees directly and by its reflections."""
    seen = wp.clone(gbuffer.view.object)
    bounces = [] if hits is None else [hits.ends, *(later.ends for later in hits.later)]
    for ends in bounces:
        launch.launch(mix_in_objects, ends.pixel.shape[0], [ends.pixel, ends.object, seen], seen.device)
    return seen


def pixels_of_contrast(gbuffer: GBuffer, hits: FirstHits | None, radiance: wp.array, samples: int) -> np.ndarray:
    """(n,) int32: the pixels that differ from a neighbour, block by block.

    Args:
        gbuffer: what they see.
        hits: what is reflected there, if the method tells.
        radiance: (pixels,) vec3.
        samples: how many a pixel may have, 2 or more.
    """
    height, width = gbuffer.shape
    marked = wp.empty(height * width, dtype=wp.uint8, device=radiance.device)
    fewer = 1.0 / math.sqrt(samples)
    inputs = [width, radiance, objects_seen(gbuffer, hits), fewer * WITHIN, fewer * AT_EDGE, marked]
    launch.launch(mark_contrast, height, inputs, radiance.device)
    return pixels_in_blocks(marked.numpy().view(bool).reshape(height, width))


def groups_of_contrast(radiance: wp.array, count: int) -> np.ndarray:
    """(n,) numbers of the groups of ``count`` samples that differ among themselves; ``radiance`` is (groups * count,)
    vec3."""
    groups = radiance.shape[0] // count
    marked = wp.empty(groups, dtype=wp.uint8, device=radiance.device)
    launch.launch(mark_varied, groups, [count, radiance, marked], radiance.device)
    return np.flatnonzero(marked.numpy())
