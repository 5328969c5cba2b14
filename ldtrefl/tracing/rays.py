"""Rays on their way and where they end, as arrays; bounding spheres along a ray.

Device space; directions have unit length.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.world.records import ObjectRecord

RUN = wp.constant(64)
"""Rays in a row that are culled together. The rays of the first bounce stand in blocks of 8 x 8 pixels."""


@wp.struct
class RayBuffer:
    """Rays on their way; a ray is dead where its source is -1."""

    pixel: wp.array(dtype=wp.int32)
    origin: wp.array(dtype=wp.vec3d)
    direction: wp.array(dtype=wp.vec3)
    weight: wp.array(dtype=wp.vec3)  # what a unit of radiance met now adds to the pixel
    source: wp.array(dtype=wp.int32)  # the object that it left


@wp.struct
class HitBuffer:
    """Where the rays of a ``RayBuffer`` end."""

    t: wp.array(dtype=float)  # device units, +inf on a miss
    object: wp.array(dtype=wp.int32)
    triangle: wp.array(dtype=wp.int32)
    barycentrics: wp.array(dtype=wp.vec2)
    steps: wp.array(dtype=wp.int32)
    searches: wp.array(dtype=wp.int32)  # objects that the ray was searched for in


LOWEST_BIT = """
#if defined(__CUDA_ARCH__)
    return __ffs((int)word) - 1;
#else
    return __builtin_ctz(word);
#endif
"""


@wp.func_native(LOWEST_BIT)
def lowest_bit(word: wp.uint32) -> wp.int32:
    """The number of the lowest bit that is set; of none, undefined."""
    ...


@wp.struct
class Regions:
    """Which objects each ray can meet: a row of bits, one per object."""

    bits: wp.array2d(dtype=wp.uint32)  # empty: every ray all objects
    rows: wp.array(dtype=wp.int32)  # of each ray; empty: its run's


@wp.func
def object_bits(regions: Regions, objects: wp.array(dtype=ObjectRecord), i: int, word: int) -> wp.uint32:
    """The objects ``32 * word`` to ``32 * word + 31`` that ray ``i`` can meet, a bit each."""
    if regions.bits.shape[0] > 0:
        if regions.rows.shape[0] > 0:
            return regions.bits[regions.rows[i], word]
        return regions.bits[i / RUN, word]
    rest = objects.shape[0] - 32 * word
    if rest >= 32:
        return ~wp.uint32(0)
    return (wp.uint32(1) << wp.uint32(rest)) - wp.uint32(1)


def word_count(objects: int) -> int:
    """Words of a row of bits."""
    return -(-objects // 32)


def bits_of(numbers: Iterable[int], objects: int) -> np.ndarray:
    """(words,) uint32: a row in which the bits of these objects are set."""
    row = np.zeros(word_count(objects), np.uint32)
    for k in numbers:
        row[k // 32] |= np.uint32(1 << k % 32)
    return row


def objects_in(table: np.ndarray, objects: int) -> set[int]:
    """Objects whose bit is set in any row of an (n, words) uint32 table."""
    union = np.bitwise_or.reduce(table, axis=0)
    return {k for k in range(objects) if union[k // 32] >> np.uint32(k % 32) & np.uint32(1)}


def regions_of_runs(bits: wp.array) -> Any:
    """``Regions`` with a row a run; with no rows, of rays that can meet all objects."""
    regions = Regions()
    regions.bits = bits
    regions.rows = wp.empty(0, dtype=wp.int32, device=bits.device)
    return regions


def run_count(rays: int) -> int:
    """Runs that hold so many rays."""
    return -(-rays // int(RUN))


def rays_of(runs: np.ndarray, rays: int) -> np.ndarray:
    """Numbers of the rays in these runs, of so many rays in all."""
    numbers = (runs[:, None] * int(RUN) + np.arange(int(RUN))).ravel()
    return numbers[numbers < rays]


def distance_across(
    origin: np.ndarray, direction: np.ndarray, other_origin: np.ndarray, other_direction: np.ndarray, t: np.ndarray
) -> np.ndarray:
    """(n,) how far apart pairs of rays are at ``t``, (n,), across the first's direction; vectors are (n, 3)."""
    gap = other_origin - origin + t[:, None] * (other_direction - direction)
    gap -= (gap * direction).sum(axis=1, keepdims=True) * direction
    return np.linalg.norm(gap, axis=1)
