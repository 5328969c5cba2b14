"""A recorded launch runs for the ranges that it is asked for, on the thread that asks."""

import threading

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.device.recorded_launch import on_this_thread, record_launch
from tests.device.launches import add_number


def test_ranges_of_a_recorded_launch() -> None:
    device = launch.resolve_device(None)
    numbers = wp.zeros(10, dtype=int, device=device)
    threads = threading.active_count()
    run = on_this_thread(record_launch(add_number, [numbers], device))
    assert not numbers.numpy().any(), "recorded, not made"
    run(2, 3)
    run(7, 1)
    np.testing.assert_array_equal(numbers.numpy(), [0, 0, 3, 4, 5, 0, 0, 8, 0, 0])
    assert threading.active_count() == threads
