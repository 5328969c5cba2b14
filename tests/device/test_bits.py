"""The lowest bit of a word, against words that are made of known bits."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bits import lowest_bit


@launch.kernel
def find_lowest_bits(
    first: int,
    # In:
    words: wp.array(dtype=wp.uint64),
    # Out:
    lowest_out: wp.array(dtype=wp.int32),
):
    """Find the lowest bit of one word."""
    i = first + wp.tid()
    lowest_out[i] = lowest_bit(words[i])


def test_the_lowest_bit_of_a_word() -> None:
    device, bits = launch.resolve_device(None), np.arange(64)
    words = (np.uint64(1) << bits.astype(np.uint64)) | (np.uint64(1) << np.uint64(63))
    found = wp.empty(64, dtype=wp.int32, device=device)
    launch.launch(find_lowest_bits, 64, [wp.array(words, dtype=wp.uint64, device=device), found], device)
    np.testing.assert_array_equal(found.numpy(), bits)
