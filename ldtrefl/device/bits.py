"""Bits of words in kernels."""

from __future__ import annotations

import warp as wp

from ldtrefl.device.native_sources import native_body


@wp.func_native(native_body({}, ("device/vectors.h",), "return Vectors::lowest_bit((unsigned long long)word);"))
def lowest_bit(word: wp.uint64) -> wp.int32:
    """The number of the lowest bit that is set; undefined if none is."""
    ...
