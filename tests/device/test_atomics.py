"""Atomic operations of many threads on the same place: the largest value stays, and every place is given once."""

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.device.atomics import keep_largest, take_place

ITEMS = 200_000


@launch.kernel
def compete(
    first: int,
    # In:
    values: wp.array(dtype=wp.int64),
    # Out:
    largest_out: wp.array(dtype=wp.int64),
    count_out: wp.array(dtype=wp.int32),
    places_out: wp.array(dtype=wp.int32),
):
    """Each thread offers its item's value to one of two places, and takes a place in a list."""
    i = first + wp.tid()
    keep_largest(largest_out, i % 2, values[i])
    places_out[i] = take_place(count_out)


@pytest.mark.parametrize("threads", [1, 2, 8])
def test_threads_that_compete_for_a_place(threads: int) -> None:
    ldtrefl.set_threads(threads)
    device = launch.resolve_device(None)
    values = np.random.default_rng(0).integers(-(2**62), 2**62, ITEMS)
    values[:4] = np.iinfo(np.int64).min
    largest = wp.array(np.full(2, np.iinfo(np.int64).min), dtype=wp.int64, device=device)
    count, places = (wp.zeros(n, dtype=wp.int32, device=device) for n in (1, ITEMS))
    inputs = [wp.array(values, dtype=wp.int64, device=device), largest, count, places]
    launch.launch(compete, ITEMS, inputs, device)
    np.testing.assert_array_equal(largest.numpy(), [values[0::2].max(), values[1::2].max()])
    assert count.numpy()[0] == ITEMS
    np.testing.assert_array_equal(np.sort(places.numpy()), np.arange(ITEMS))
