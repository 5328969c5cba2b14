"""Lists of objects by run: each gets the room that it needs, and long ones are put in order."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.regions import put_in_order
from ldtrefl.frame.run_lists import ROOM, RunLists, listed, set_entry
from ldtrefl.tracing.object_sets import entries


@launch.kernel
def list_counted(
    first: int,
    # In:
    counts: wp.array(dtype=wp.int32),
    keys: wp.array2d(dtype=float),
    room: int,
    # In and out:
    lists: RunLists,
):
    """Give one run's list as many objects as are asked for, and put it in order."""
    run = first + wp.tid()
    for k in range(wp.min(counts[run], room)):
        set_entry(lists, lists.start[run] + k, k, wp.uint64(k), keys[run, k])
    lists.count[run] = counts[run]
    if counts[run] <= room:
        put_in_order(lists, lists.start[run], counts[run])


@pytest.mark.parametrize("most", [0, 3, ROOM, ROOM + 1, 300])
def test_every_list_has_all_of_its_objects_in_order(most: int) -> None:
    device, rng = launch.resolve_device(None), np.random.default_rng(most)
    counts = rng.integers(0, most + 1, 20)
    counts[7] = most
    keys = rng.integers(0, 50, (20, max(most, 1))).astype(np.float32)
    fills = []

    def fill(lists: RunLists, room: int) -> None:
        fills.append(room)
        given = [wp.array(counts, dtype=wp.int32, device=device), wp.array(keys, dtype=float, device=device)]
        launch.launch(list_counted, 20, [*given, room, lists], device)

    sets = listed(20, 300, device, fill)
    assert fills == ([ROOM] if most <= ROOM else [ROOM, 300])
    runs, objects = entries(sets)
    for run in range(20):
        mine = objects[runs == run]
        assert sorted(mine.tolist()) == list(range(counts[run]))
        assert (np.diff(keys[run, mine]) >= 0).all()
    start = sets.start.numpy()
    taken = sets.rays.numpy()[np.concatenate([start[r] + np.arange(counts[r]) for r in range(20)])]
    np.testing.assert_array_equal(taken, objects.astype(np.uint64))
