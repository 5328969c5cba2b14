"""Copies of structs: whole ones, whatever they hold, that kernels read."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.struct_copies import struct_copies


@wp.struct
class Pair:
    """A struct with an array and a gap before it."""

    small: wp.uint8
    values: wp.array(dtype=float)


@launch.kernel
def read_pairs(first: int, pairs: wp.array(dtype=Pair), out: wp.array(dtype=float)):
    """Add up what one struct holds."""
    i = first + wp.tid()
    out[i] = float(pairs[i].small) + pairs[i].values[0]


def test_kernels_read_the_copies() -> None:
    cpu, pairs = launch.resolve_device("cpu"), []
    for k in range(3):
        pair = Pair()
        pair.small, pair.values = wp.uint8(k), wp.full(1, 10.0 * k, dtype=float, device=cpu)
        pairs.append(pair)
    numbers = np.array([2, 0, 2, 1])
    copies = struct_copies(wp.array(pairs, dtype=Pair, device=cpu).numpy(), numbers)
    found = wp.zeros(4, dtype=float, device=cpu)
    launch.launch(read_pairs, 4, [wp.array(copies, dtype=Pair, device=cpu, copy=False), found], cpu)
    np.testing.assert_array_equal(found.numpy(), 11.0 * numbers)
    assert len(struct_copies(copies, numbers[:0])) == 0
