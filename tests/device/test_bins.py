"""Bins and chunks: places that sort items stably, and lists joined in order."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import CHUNK, bin_items, chunk_count, exclusive_scan, gather_lists, launch_chunks


@launch.kernel
def list_multiples(
    first: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    divisor: int,
    # Out:
    counts_out: wp.array(dtype=wp.int32),
    lists_out: wp.array(dtype=wp.int32),
):
    """Each thread lists the multiples among the numbers of one chunk."""
    chunk = first + wp.tid()
    begin = CHUNK * chunk
    count = int(0)
    for i in range(begin, wp.min(begin + CHUNK, numbers.shape[0])):
        if numbers[i] % divisor == 0:
            lists_out[begin + count] = numbers[i]
            count += 1
    counts_out[chunk] = count


@pytest.mark.parametrize(("items", "bins"), [(0, 5), (1, 1), (10_000, 37), (500, 3000)])
def test_items_are_sorted_by_bin_and_stay_in_order(items: int, bins: int) -> None:
    device = launch.resolve_device(None)
    numbers = np.random.default_rng(items).integers(0, bins, items)
    start, ranks = (
        array.numpy() for array in bin_items(wp.array(numbers, dtype=wp.int32, device=device), bins, device)
    )
    np.testing.assert_array_equal(start, np.searchsorted(np.sort(numbers), np.arange(bins + 1)))
    order = np.empty(items, int)
    order[start[numbers] + ranks] = np.arange(items)
    np.testing.assert_array_equal(order, np.argsort(numbers, kind="stable"))


def test_a_scan_ends_with_the_total() -> None:
    sums, total = exclusive_scan(wp.array([3, 0, 4, 0], dtype=wp.int32, device=launch.resolve_device(None)))
    np.testing.assert_array_equal(sums.numpy(), [0, 3, 3, 7])
    assert total == 7 and type(total) is int


@pytest.mark.parametrize("items", [1, int(CHUNK) - 1, int(CHUNK), int(CHUNK) + 1, 10 * int(CHUNK) + 77])
@pytest.mark.parametrize("divisor", [1, 7, 10**9])
def test_lists_of_chunks_are_joined_in_order(items: int, divisor: int) -> None:
    device = launch.resolve_device(None)
    numbers = np.random.default_rng(items).integers(1, 10**6, items)
    counts = wp.zeros(chunk_count(items) + 1, dtype=wp.int32, device=device)
    lists = wp.empty(items, dtype=wp.int32, device=device)
    given = wp.array(numbers, dtype=wp.int32, device=device)
    launch_chunks(list_multiples, items, [given, divisor, counts, lists], device)
    np.testing.assert_array_equal(gather_lists(lists, counts).numpy(), numbers[numbers % divisor == 0])


def test_chunks_hold_all_items() -> None:
    sizes = (0, 1, int(CHUNK), int(CHUNK) + 1)
    assert [chunk_count(items) for items in sizes] == [0, 1, 1, 2]
