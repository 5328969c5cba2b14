"""Sorting items into bins by number: count, prefix sum, place.

Stable and the same for any number of threads: each part of a launch owns a run of bins and goes through the items in
order (``launch.launch_parts``). On CUDA the order within a bin is left to chance.
"""

from __future__ import annotations

import warp as wp

from ldtrefl import launch


@wp.func
def bin_is_in_part(number: int, bins: int, part: int, parts: int) -> bool:
    """Whether a bin belongs to one of ``parts`` equal runs of the bins."""
    return int(wp.int64(number) * wp.int64(parts) / wp.int64(bins)) == part


@launch.kernel
def count_items(
    part: int,
    parts: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    bins: int,
    # Out:
    counts_out: wp.array(dtype=wp.int32),
):
    i = wp.tid()
    number = numbers[i]
    if bin_is_in_part(number, bins, part, parts):
        wp.atomic_add(counts_out, number, 1)


@launch.kernel
def place_items(
    part: int,
    parts: int,
    # In:
    numbers: wp.array(dtype=wp.int32),
    bins: int,
    start: wp.array(dtype=wp.int32),
    # Out:
    filled_out: wp.array(dtype=wp.int32),
    places_out: wp.array(dtype=wp.int32),
):
    i = wp.tid()
    number = numbers[i]
    if bin_is_in_part(number, bins, part, parts):
        places_out[i] = start[number] + wp.atomic_add(filled_out, number, 1)


@launch.kernel
def list_marked(
    first: int,
    # In:
    marked: wp.array(dtype=wp.int32),
    places: wp.array(dtype=wp.int32),
    # Out:
    list_out: wp.array(dtype=wp.int32),
):
    i = first + wp.tid()
    if marked[i] != 0:
        list_out[places[i]] = i


def exclusive_scan(counts: wp.array) -> tuple[wp.array, int]:
    """(prefix sums, their last): ``counts`` ends with a 0 that the total takes the place of."""
    sums = wp.empty_like(counts)
    wp.utils.array_scan(counts, sums, inclusive=False)
    return sums, int(sums[-1:].numpy()[0])


def bin_items(numbers: wp.array, bins: int, device: wp.Device) -> tuple[wp.array, wp.array]:
    """Sort items by bin.

    Returns:
        start: (bins + 1,) int32, first place of each bin.
        places: (items,) int32, the place of each item.
    """
    items = numbers.shape[0]
    counts = wp.zeros(bins + 1, dtype=wp.int32, device=device)
    launch.launch_parts(count_items, items, [numbers, bins, counts], device)
    start, _ = exclusive_scan(counts)
    counts.zero_()
    places = wp.empty(items, dtype=wp.int32, device=device)
    launch.launch_parts(place_items, items, [numbers, bins, start, counts, places], device)
    return start, places


def list_items(marked: wp.array) -> wp.array:
    """Numbers of the items marked with 1, in order; ``marked`` has one entry more than there are items, a 0."""
    places, count = exclusive_scan(marked)
    listed = wp.empty(count, dtype=wp.int32, device=marked.device)
    launch.launch(list_marked, marked.shape[0] - 1, [marked, places, listed], marked.device)
    return listed
