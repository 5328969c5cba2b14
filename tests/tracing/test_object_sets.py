"""Lists of the objects that rays can meet, against Python's sets."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.tracing.object_sets import (
    RUN,
    ObjectSets,
    all_sets,
    entries,
    is_listed,
    object_listed,
    objects_listed,
    rays_of,
    run_count,
    sets_for_runs,
)
from tests.tracing.boxes import sets_of_rays


@launch.kernel
def list_objects(
    first: int,
    # In:
    sets: ObjectSets,
    objects: int,
    # Out:
    met_out: wp.array2d(dtype=wp.uint8),
):
    """Count, for one ray, how often each object stands in its list."""
    i = first + wp.tid()
    run = i / RUN
    for entry in range(objects_listed(sets, objects, run)):
        k = object_listed(sets, run, entry)
        if is_listed(sets, run, entry, i):
            met_out[i, k] = met_out[i, k] + wp.uint8(1)


def objects_met(sets: ObjectSets, rays: int, objects: int) -> list[set[int]]:
    """By ray, the objects that a kernel finds in its list; each must be found once."""
    device = launch.resolve_device(None)
    met = wp.zeros((rays, objects), dtype=wp.uint8, device=device)
    launch.launch(list_objects, rays, [sets, objects, met], device)
    assert met.numpy().max() <= 1
    return [set(np.flatnonzero(row).tolist()) for row in met.numpy()]


@pytest.mark.parametrize("objects", [1, 31, 32, 33, 70])
def test_without_lists_every_ray_can_meet_all(objects: int) -> None:
    assert objects_met(all_sets(launch.resolve_device(None)), 3, objects) == [set(range(objects))] * 3


def test_lists_tell_runs_and_rays_apart() -> None:
    rng = np.random.default_rng(0)
    rays = 2 * int(RUN) + 5
    expected = [set(rng.choice(70, rng.integers(0, 9), replace=False).tolist()) for _ in range(rays)]
    sets = sets_of_rays(expected, launch.resolve_device(None))
    assert objects_met(sets, rays, 70) == expected
    ends = sets_for_runs(sets, np.array([0, 2]))
    assert objects_met(ends, int(RUN) + 5, 70) == expected[: int(RUN)] + expected[2 * int(RUN) :]
    runs, objects = entries(sets)
    by_run = [set().union(*expected[begin : begin + int(RUN)]) for begin in range(0, rays, int(RUN))]
    assert [set(objects[runs == run].tolist()) for run in range(3)] == by_run
    runs, objects = entries(ends)
    assert [set(objects[runs == run].tolist()) for run in range(2)] == [by_run[0], by_run[2]]


def test_runs_are_counted_up() -> None:
    run = int(RUN)
    assert [run_count(n) for n in (0, 1, run, run + 1)] == [0, 1, 1, 2]
    assert rays_of(np.array([0, 2]), 2 * run + 3).tolist() == [*range(run), *range(2 * run, 2 * run + 3)]
