"""Counting sort of items into bins, and listing the few of many items that a kernel selects (stream compaction).

*Bins*: items are counted and ranked, and the counts are summed up. Item i then belongs in place
``start[number[i]] + rank[i]``. The order is stable and the same for any number of threads, as the CPU counts the items
one after another on one thread. On CUDA the order within a bin is left to chance.

*Chunks*: a kernel that selects few of its items goes through them in chunks of ``CHUNK``. Each chunk lists the items
that it selects at the place of its own first item, and counts them. The lists are then joined. So only the chunks'
counts are summed up, and not a mark for every item.
"""

from __future__ import annotations

from collections.abc import Sequence

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
    """Each thread counts one item in its bin. Launched in order on the CPU."""
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
    """Each thread copies the list of one chunk to its place among all."""
    chunk = first + wp.tid()
    for k in range(places[chunk + 1] - places[chunk]):
        list_out[places[chunk] + k] = lists[CHUNK * chunk + k]


def chunk_count(items: int) -> int:
    """The number of chunks that ``items`` items make."""
    return -(-items // int(CHUNK))


def launch_chunks(kernel: wp.Kernel, items: int, arguments: Sequence[object], device: wp.Device) -> None:
    """Run ``kernel(first, *arguments)`` for the chunks of ``items`` items: its items are chunks."""
    launch.launch(kernel, chunk_count(items), arguments, device)


def exclusive_scan(counts: wp.array) -> tuple[wp.array, int]:
    """(for each count the sum of those before it, total). The last count is 0; the total stands in its place."""
    sums = wp.empty_like(counts)
    wp.utils.array_scan(counts, sums, inclusive=False)
    # On the CPU the array is read where it lies; from CUDA only its last number comes.
    last = sums if sums.device.is_cpu else sums[-1:]
    return sums, int(last.numpy()[-1])


def bin_items(numbers: wp.array, bins: int, device: wp.Device) -> tuple[wp.array, wp.array]:
    """Find the places of items sorted by bin.

    Args:
        numbers: (items,) int32, the bin of each item.
        bins: how many bins there are.
        device: where ``numbers`` is.

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
    """Join the lists of all chunks in order: (selected items,) int32.

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
