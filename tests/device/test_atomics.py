"""Atomic operations of many threads on the same place: the largest stays, places are given once, sums are whole."""

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.device.atomics import add_to, keep_largest, take_place

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
    sums_out: wp.array(dtype=wp.int64),
):
    """Each thread offers its value to one of two places, takes a place in a list, and adds to one of two sums."""
    i = first + wp.tid()
    keep_largest(largest_out, i % 2, values[i])
    places_out[i] = take_place(count_out)
    add_to(sums_out, i % 2, wp.int64(i))


@pytest.mark.parametrize("threads", [1, 2, 8])
def test_threads_that_compete_for_a_place(threads: int) -> None:
    ldtrefl.set_threads(threads)
    device = launch.resolve_device(None)
    values = np.random.default_rng(0).integers(-(2**62), 2**62, ITEMS)
    values[:4] = np.iinfo(np.int64).min
    largest = wp.array(np.full(2, np.iinfo(np.int64).min), dtype=wp.int64, device=device)
    count, places = (wp.zeros(n, dtype=wp.int32, device=device) for n in (1, ITEMS))
    sums = wp.zeros(2, dtype=wp.int64, device=device)
    inputs = [wp.array(values, dtype=wp.int64, device=device), largest, count, places, sums]
    launch.launch(compete, ITEMS, inputs, device)
    np.testing.assert_array_equal(largest.numpy(), [values[0::2].max(), values[1::2].max()])
    assert count.numpy()[0] == ITEMS
    np.testing.assert_array_equal(sums.numpy(), [sum(range(0, ITEMS, 2)), sum(range(1, ITEMS, 2))])
    np.testing.assert_array_equal(np.sort(places.numpy()), np.arange(ITEMS))
