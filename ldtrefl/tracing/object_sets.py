"""Which objects each ray can meet, as a list for each *run* of rays.

Rays come in runs that stand together on the screen: the rays of the first bounce stand in blocks of 8 x 8 pixels. The
list of a run names the objects that any of its rays can meet, each with a bit for every ray that can.
"""

from __future__ import annotations

import numpy as np
import warp as wp

RUN = wp.constant(64)
"""Rays in a row that share a list: as many as an integer has bits."""


@wp.struct
class ObjectSets:
    """The objects that rays can meet, run by run."""

    start: wp.array(dtype=wp.int32)  # of each run, its first entry; empty: every ray can meet all objects
    count: wp.array(dtype=wp.int32)  # of each run's entries
    object: wp.array(dtype=wp.int32)  # of each entry
    rays: wp.array(dtype=wp.uint64)  # of each entry, the rays of the run that can meet it, a bit each


@wp.func
def objects_listed(sets: ObjectSets, objects: int, run: int) -> int:
    """How many objects the rays of a run may meet, of so many in all."""
    if sets.start.shape[0] == 0:
        return objects
    return sets.count[run]


@wp.func
def object_listed(sets: ObjectSets, run: int, entry: int) -> int:
    """The number of an object that the rays of a run may meet."""
    if sets.start.shape[0] == 0:
        return entry
    return sets.object[sets.start[run] + entry]


@wp.func
def is_listed(sets: ObjectSets, run: int, entry: int, i: int) -> bool:
    """Whether ray ``i``, of this run, can meet that object."""
    if sets.start.shape[0] == 0:
        return True
    return (sets.rays[sets.start[run] + entry] >> wp.uint64(i - RUN * run)) & wp.uint64(1) != wp.uint64(0)


def all_sets(device: wp.Device) -> ObjectSets:
    """Every ray can meet all objects."""
    sets = ObjectSets()
    sets.start, sets.count, sets.object = (wp.empty(0, dtype=wp.int32, device=device) for _ in range(3))
    sets.rays = wp.empty(0, dtype=wp.uint64, device=device)
    return sets


def sets_for_runs(sets: ObjectSets, runs: np.ndarray) -> ObjectSets:
    """The lists of these runs alone, (m,) by number."""
    chosen = ObjectSets()
    device = sets.start.device
    chosen.start, chosen.count = (
        wp.array(array.numpy()[runs], dtype=wp.int32, device=device) for array in (sets.start, sets.count)
    )
    chosen.object, chosen.rays = sets.object, sets.rays
    return chosen


def entries(sets: ObjectSets) -> tuple[np.ndarray, np.ndarray]:
    """(k,) the run and (k,) the object of every entry of the lists, run by run."""
    start, count = sets.start.numpy(), sets.count.numpy()
    runs = np.repeat(np.arange(len(count)), count)
    within = np.arange(len(runs)) - np.repeat(np.cumsum(count) - count, count)
    return runs, sets.object.numpy()[start[runs] + within]


def run_count(rays: int) -> int:
    """The number of runs that so many rays make."""
    return -(-rays // int(RUN))


def rays_of(runs: np.ndarray, rays: int) -> np.ndarray:
    """Numbers of the rays in these runs; ``rays`` is how many rays there are in all."""
    numbers = (runs[:, None] * int(RUN) + np.arange(int(RUN))).ravel()
    return numbers[numbers < rays]
