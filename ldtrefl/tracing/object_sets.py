"""Which objects each ray can meet, as a row of bits: one row for a *run* of rays, or for each ray its own.

Rays come in runs that stand together on the screen: the rays of the first bounce stand in blocks of 8 x 8 pixels.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import warp as wp

from ldtrefl.world.records import ObjectRecord

RUN = wp.constant(64)
"""Rays in a row that share a row of bits."""

LOWEST_BIT = """
#if defined(__CUDA_ARCH__)
    return __ffs((int)word) - 1;
#else
    return __builtin_ctz(word);
#endif
"""


@wp.func_native(LOWEST_BIT)
def lowest_bit(word: wp.uint32) -> wp.int32:
    """The number of the lowest bit that is set; undefined if none is."""
    ...


@wp.struct
class ObjectSets:
    """The objects that each ray can meet, a bit an object."""

    bits: wp.array2d(dtype=wp.uint32)  # empty: every ray can meet all objects
    rows: wp.array(dtype=wp.int32)  # the row of each ray; empty: its run's


@wp.func
def object_bits(sets: ObjectSets, objects: wp.array(dtype=ObjectRecord), i: int, word: int) -> wp.uint32:
    """The objects ``32 * word`` to ``32 * word + 31`` that ray ``i`` can meet, a bit each."""
    if sets.bits.shape[0] > 0:
        if sets.rows.shape[0] > 0:
            return sets.bits[sets.rows[i], word]
        return sets.bits[i / RUN, word]
    rest = objects.shape[0] - 32 * word
    if rest >= 32:
        return ~wp.uint32(0)
    return (wp.uint32(1) << wp.uint32(rest)) - wp.uint32(1)


@wp.func
def without(bits: wp.uint32, k: int) -> wp.uint32:
    """The bits without that of object ``k``."""
    return bits & ~(wp.uint32(1) << wp.uint32(k % 32))


@wp.func
def has_bit(bits: wp.uint32, k: int) -> bool:
    """Whether the bit of object ``k`` is set in its word."""
    return (bits & (wp.uint32(1) << wp.uint32(k % 32))) != wp.uint32(0)


def word_count(objects: int) -> int:
    """32-bit words in a row of bits for so many objects."""
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


def sets_of_runs(bits: wp.array) -> ObjectSets:
    """Sets that have a row of bits for each run. Without any rows every ray can meet all objects."""
    sets = ObjectSets()
    sets.bits = bits
    sets.rows = wp.empty(0, dtype=wp.int32, device=bits.device)
    return sets


def run_count(rays: int) -> int:
    """The number of runs that so many rays make."""
    return -(-rays // int(RUN))


def rays_of(runs: np.ndarray, rays: int) -> np.ndarray:
    """Numbers of the rays in these runs; ``rays`` is how many rays there are in all."""
    numbers = (runs[:, None] * int(RUN) + np.arange(int(RUN))).ravel()
    return numbers[numbers < rays]
