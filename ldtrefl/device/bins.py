"""Sorting items into bins by number, and listing some of many items.

*Bins*: count and rank, prefix sum; item i then goes to ``start[number[i]] + rank[i]``. Stable and the same for any
number of threads: the CPU counts the items in order on one. On CUDA the order within a bin is left to chance.

*Chunks*: a kernel that keeps few of its items goes through them in chunks, each of which lists what it keeps where the
chunk's own items stand; the lists are then joined. Only the chunks' counts are summed, not a mark for every item.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import warp as wp

from ldtrefl.device import launch

CHUNK = wp.constant(1024)
"""Items in a chunk."""


@launch.kernel
def count_items(
    first: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    # Out:
    counts_out: wp.array(dtype=wp.int32),
    ranks_out: wp.array(dtype=wp.int32),  # in their bins
):
    i = first + wp.tid()
    ranks_out[i] = wp.atomic_add(counts_out, numbers[i], 1)


@launch.kernel
def copy_lists(
    first: int,
    # In:
    lists: wp.array(dtype=wp.int32),
    places: wp.array(dtype=wp.int32),
    # Out:
    list_out: wp.array(dtype=wp.int32),
):
    chunk = first + wp.tid()
    for k in range(places[chunk + 1] - places[chunk]):
        list_out[places[chunk] + k] = lists[CHUNK * chunk + k]


def chunk_count(items: int) -> int:
    """Chunks that hold so many items."""
    return -(-items // int(CHUNK))


def launch_chunks(kernel: wp.Kernel, items: int, arguments: Sequence[Any], device: wp.Device) -> None:
    """Run a kernel over the chunks of ``items``."""
    launch.launch(kernel, chunk_count(items), arguments, device)


def exclusive_scan(counts: wp.array) -> tuple[wp.array, int]:
    """(prefix sums, their last): ``counts`` ends with a 0 that the total takes the place of."""
    sums = wp.empty_like(counts)
    wp.utils.array_scan(counts, sums, inclusive=False)
    # On the CPU the array is read where it lies; from CUDA only its last number comes.
    last = sums if sums.device.is_cpu else sums[-1:]
    return sums, int(last.numpy()[-1])


def bin_items(numbers: wp.array, bins: int, device: wp.Device) -> tuple[wp.array, wp.array]:
    """Sort items by bin.

    Returns:
        start: (bins + 1,) int32, first place of each bin.
        ranks: (items,) int32, the place of each item in its bin.
    """
    items = numbers.shape[0]
    counts = wp.zeros(bins + 1, dtype=wp.int32, device=device)
    ranks = wp.empty(items, dtype=wp.int32, device=device)
    launch.launch_in_order(count_items, items, [numbers, counts, ranks], device)
    start, _ = exclusive_scan(counts)
    return start, ranks


def gather_lists(lists: wp.array, counts: wp.array) -> wp.array:
    """One list of what each chunk listed, in order.

    Args:
        lists: (items,) int32; a chunk's list starts at its first item.
        counts: (chunks + 1,) int32, lengths of the lists, a 0 at the end.
    """
    places, total = exclusive_scan(counts)
    if total == lists.shape[0]:
        return lists  # all are kept, and stand where they belong
    gathered = wp.empty(total, dtype=wp.int32, device=lists.device)
    if total:
        launch_chunks(copy_lists, lists.shape[0], [lists, places, gathered], lists.device)
    return gathered
