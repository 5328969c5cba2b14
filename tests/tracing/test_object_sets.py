"""Rows of bits: which objects a ray can meet, against Python's sets."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.tracing.object_sets import (
    RUN,
    ObjectSets,
    bits_of,
    has_bit,
    lowest_bit,
    object_bits,
    objects_in,
    rays_of,
    run_count,
    sets_of_runs,
    without,
    word_count,
)
from ldtrefl.world.records import ObjectRecord


@launch.kernel
def list_objects(
    first: int,
    # In:
    sets: ObjectSets,
    objects: wp.array(dtype=ObjectRecord),
    # Out:
    met_out: wp.array2d(dtype=wp.uint8),
):
    """Mark the objects that one ray can meet, word after word, and check each bit by itself."""
    i = first + wp.tid()
    for word in range((objects.shape[0] + 31) / 32):
        bits = object_bits(sets, objects, i, word)
        while bits != wp.uint32(0):
            k = lowest_bit(bits)
            if has_bit(bits, k):
                met_out[i, 32 * word + k] = met_out[i, 32 * word + k] + wp.uint8(1)
            bits = without(bits, k)


def objects_met(sets: ObjectSets, rays: int, objects: int) -> list[set[int]]:
    """By ray, the objects that a kernel finds in its row; each must be found once."""
    device = launch.resolve_device(None)
    met = wp.zeros((rays, objects), dtype=wp.uint8, device=device)
    launch.launch(list_objects, rays, [sets, wp.empty(objects, dtype=ObjectRecord, device=device), met], device)
    assert met.numpy().max() <= 1
    return [set(np.flatnonzero(row).tolist()) for row in met.numpy()]


@pytest.mark.parametrize("objects", [1, 31, 32, 33, 70])
def test_without_rows_every_ray_can_meet_all(objects: int) -> None:
    device = launch.resolve_device(None)
    none = sets_of_runs(wp.empty((0, 0), dtype=wp.uint32, device=device))
    assert objects_met(none, 3, objects) == [set(range(objects))] * 3


def test_rows_belong_to_runs_or_to_rays() -> None:
    device, run = launch.resolve_device(None), int(RUN)
    rows = [{0, 5, 31}, {32, 69}, set()]
    table = np.stack([bits_of(row, 70) for row in rows])
    bits = wp.array(table, dtype=wp.uint32, device=device)
    met = objects_met(sets_of_runs(bits), 2 * run + 1, 70)
    assert met == [rows[0]] * run + [rows[1]] * run + [rows[2]]
    own = sets_of_runs(bits)
    own.rows = wp.array([2, 0, 1], dtype=wp.int32, device=device)
    assert objects_met(own, 3, 70) == [rows[2], rows[0], rows[1]]
    assert objects_in(table, 70) == {0, 5, 31, 32, 69}


def test_words_and_runs_are_counted_up() -> None:
    assert [word_count(n) for n in (0, 1, 32, 33)] == [0, 1, 1, 2]
    run = int(RUN)
    assert [run_count(n) for n in (0, 1, run, run + 1)] == [0, 1, 1, 2]
    assert rays_of(np.array([0, 2]), 2 * run + 3).tolist() == [*range(run), *range(2 * run, 2 * run + 3)]
