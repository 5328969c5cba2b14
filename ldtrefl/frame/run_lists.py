"""Lists of objects, one for each run of rays (``tracing/object_sets.py``), as kernels make them.

Most runs meet few objects. So each is first given room for some; if any needs more, all lists are made once again, each
with the room that it needs.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import warp as wp

from ldtrefl.base import budget
from ldtrefl.tracing.object_sets import ObjectSets

ROOM = 16
"""Objects for which a list has room at first."""

ENTRY_BYTES = 16


@wp.struct
class RunLists:
    """Lists of objects on their way to be ``ObjectSets``."""

    start: wp.array(dtype=wp.int32)  # of each run, its first entry
    count: wp.array(dtype=wp.int32)  # of each run's objects, those without room counted, too
    object: wp.array(dtype=wp.int32)  # of each entry
    rays: wp.array(dtype=wp.uint64)  # of each entry, the rays that can meet it, a bit each
    entry: wp.array(dtype=float)  # of each entry, where the first of these rays enters its bounding sphere


@wp.func
def set_entry(lists: RunLists, place: int, k: int, rays: wp.uint64, entry: float):
    """Write an entry: object ``k``, and the rays that can meet it."""
    lists.object[place] = k
    lists.rays[place] = rays
    lists.entry[place] = entry


@wp.func
def swap_entries(lists: RunLists, i: int, j: int):
    """Exchange two entries."""
    k = lists.object[i]
    rays = lists.rays[i]
    entry = lists.entry[i]
    set_entry(lists, i, lists.object[j], lists.rays[j], lists.entry[j])
    set_entry(lists, j, k, rays, entry)


def listed(runs: int, objects: int, device: wp.Device, fill: Callable[[RunLists, int], None]) -> ObjectSets:
    """The lists of so many runs, of so many objects in all.

    Args:
        runs: how many runs there are.
        objects: how many objects there are.
        device: where the lists are.
        fill: writes the lists and their counts; it is given the lists, and for how many objects each has room.

    Raises:
        InputError: the lists need more memory than is allowed.
    """
    room = min(ROOM, objects)
    lists = _empty(np.arange(runs) * room, runs * room, device)
    fill(lists, room)
    counts = lists.count.numpy().astype(np.int64)
    if counts.max(initial=0) > room:
        total = int(counts.sum())
        budget.take(ENTRY_BYTES * total, f"{total} objects in the way of reflected rays", "the number of objects")
        lists = _empty(np.cumsum(counts) - counts, total, device)
        fill(lists, objects)
    sets = ObjectSets()
    sets.start, sets.count, sets.object, sets.rays = lists.start, lists.count, lists.object, lists.rays
    return sets


def _empty(starts: np.ndarray, entries: int, device: wp.Device) -> RunLists:
    lists = RunLists()
    lists.start = wp.array(starts.astype(np.int32), dtype=wp.int32, device=device)
    lists.count = wp.empty(len(starts), dtype=wp.int32, device=device)
    lists.object = wp.empty(entries, dtype=wp.int32, device=device)
    lists.rays = wp.empty(entries, dtype=wp.uint64, device=device)
    lists.entry = wp.empty(entries, dtype=float, device=device)
    return lists
