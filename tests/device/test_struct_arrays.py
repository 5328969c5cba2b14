"""Arrays of structs that the host fills: kernels read what numpy wrote, whatever the structs hold."""

import gc

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.struct_arrays import copy_structs, host_structs, numpy_type


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


def test_kernels_read_what_was_written_and_copied() -> None:
    cpu, pairs = launch.resolve_device("cpu"), []
    for k in range(3):
        pair = Pair()
        pair.small, pair.values = wp.uint8(k), wp.full(1, 10.0 * k, dtype=float, device=cpu)
        pairs.append(pair)
    numbers = np.array([2, 0, 2, 1])
    copies, rows = host_structs(4, Pair)
    copy_structs(wp.array(pairs, dtype=Pair, device=cpu).numpy(), numbers, rows)
    rows["small"][3] = 100
    found = wp.zeros(4, dtype=float, device=cpu)
    launch.launch(read_pairs, 4, [copies, found], cpu)
    np.testing.assert_array_equal(found.numpy(), [22.0, 0.0, 22.0, 110.0])


def test_the_memory_lives_as_long_as_either_is_used() -> None:
    rows = host_structs(1000, Pair)[1]
    rows["small"] = 7
    gc.collect()
    others = [host_structs(1000, Pair)[1] for _ in range(20)]
    for other in others:
        other["small"] = 9
    assert (rows["small"] == 7).all() and rows.dtype == numpy_type(Pair) == np.dtype(Pair.numpy_dtype())


def test_none() -> None:
    made, rows = host_structs(0, Pair)
    copy_structs(np.zeros(2, numpy_type(Pair)), np.zeros(0, int), rows)
    assert made.shape == (0,) and rows.shape == (0,)
