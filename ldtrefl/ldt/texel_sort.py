"""Fragments -> their texels, each texel sorted.

A texel's fragments are sorted by depth; of two at one depth the one of the smaller triangle comes first. So the bits
are the same for any number of threads, and whatever order the fragments come in.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.bins import bin_items
from ldtrefl.ldt.fragments import Fragments

INSERTION_LIMIT = wp.constant(24)
"""Fragments in a texel up to which insertion sort beats heap sort."""


@launch.kernel
def scatter_fragments(
    first: int,
    # In:
    texel: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    ranks: wp.array(dtype=wp.int32),
    depth: wp.array(dtype=wp.float32),
    reference: wp.array(dtype=wp.int32),
    # Out:
    depth_out: wp.array(dtype=wp.float32),
    reference_out: wp.array(dtype=wp.int32),
):
    """A thread puts one fragment into its place in its texel."""
    i = first + wp.tid()
    place = start[texel[i]] + ranks[i]
    depth_out[place] = depth[i]
    reference_out[place] = reference[i]


@wp.func
def comes_before(depth_a: float, reference_a: int, depth_b: float, reference_b: int) -> bool:
    """The order in a texel: by depth, equal depths by triangle."""
    return depth_a < depth_b or (depth_a == depth_b and reference_a < reference_b)


@wp.func
def insertion_sort(depth: wp.array(dtype=wp.float32), reference: wp.array(dtype=wp.int32), first: int, end: int):
    """Sort a short run."""
    for i in range(first + 1, end):
        d = depth[i]
        r = reference[i]
        j = int(i)
        while j > first and comes_before(d, r, depth[j - 1], reference[j - 1]):
            depth[j] = depth[j - 1]
            reference[j] = reference[j - 1]
            j -= 1
        depth[j] = d
        reference[j] = r


@wp.func
def sift_down(
    depth: wp.array(dtype=wp.float32), reference: wp.array(dtype=wp.int32), first: int, root: int, count: int
):
    """Restore the heap of a run below its element ``root``."""
    d = depth[first + root]
    r = reference[first + root]
    parent = int(root)
    child = 2 * parent + 1
    while child < count:
        if child + 1 < count and comes_before(
            depth[first + child], reference[first + child], depth[first + child + 1], reference[first + child + 1]
        ):
            child += 1
        if not comes_before(d, r, depth[first + child], reference[first + child]):
            break
        depth[first + parent] = depth[first + child]
        reference[first + parent] = reference[first + child]
        parent = child
        child = 2 * parent + 1
    depth[first + parent] = d
    reference[first + parent] = r


@wp.func
def heap_sort(depth: wp.array(dtype=wp.float32), reference: wp.array(dtype=wp.int32), first: int, end: int):
    """Sort a long run: a texel may hold a whole mesh."""
    count = end - first
    root = count / 2 - 1
    while root >= 0:
        sift_down(depth, reference, first, root, count)
        root -= 1
    last = count - 1
    while last > 0:
        d = depth[first]
        r = reference[first]
        depth[first] = depth[first + last]
        reference[first] = reference[first + last]
        depth[first + last] = d
        reference[first + last] = r
        sift_down(depth, reference, first, 0, last)
        last -= 1


@launch.kernel
def sort_texel_runs(
    first: int,
    # In:
    start: wp.array(dtype=wp.int32),
    # In and out:
    depth: wp.array(dtype=wp.float32),
    reference: wp.array(dtype=wp.int32),
):
    """A thread sorts the fragments of one texel."""
    texel = first + wp.tid()
    begin, end = start[texel], start[texel + 1]
    if end - begin > INSERTION_LIMIT:
        heap_sort(depth, reference, begin, end)
    elif end - begin > 1:
        insertion_sort(depth, reference, begin, end)


def sort_into_texels(fragments: Fragments, texels: int) -> tuple[wp.array, wp.array, wp.array]:
    """Put fragments into their texels, of which there are ``texels``, and sort each texel.

    Returns:
        start: (texels + 1,) int32, the first fragment of each texel.
        depth: (n,) float32, in the order of the texels.
        reference: (n,) int32, in the same order.
    """
    device = fragments.texel.device
    start, ranks = bin_items(fragments.texel, texels, device)
    depth, reference = wp.empty_like(fragments.depth), wp.empty_like(fragments.reference)
    inputs = [fragments.texel, start, ranks, fragments.depth, fragments.reference]
    launch.launch(scatter_fragments, fragments.texel.shape[0], [*inputs, depth, reference], device)
    sort_texels(start, depth, reference)
    return start, depth, reference


def sort_texels(start: wp.array, depth: wp.array, reference: wp.array) -> None:
    """Sort the fragments of each texel in place."""
    launch.launch(sort_texel_runs, start.shape[0] - 1, [start, depth, reference], start.device)
