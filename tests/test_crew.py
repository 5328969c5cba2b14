"""Launches over CPU threads: every item once, whoever works at it."""

import threading

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl import launch


@launch.kernel
def add_number(first: int, numbers: wp.array(dtype=int)):
    i = first + wp.tid()
    numbers[i] += i + 1


def assert_all_launched(count: int, times: int) -> None:
    device = launch.resolve_device(None)
    numbers = wp.zeros(count + 1, dtype=int, device=device)
    for _ in range(times):
        launch.launch(add_number, count, [numbers], device)
    np.testing.assert_array_equal(numbers.numpy(), [*(times * np.arange(1, count + 1)), 0])


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
@pytest.mark.parametrize("count", [1, 2, 63, 129, 1000, 100_003])
def test_every_item_once(threads: int, count: int) -> None:
    ldtrefl.set_threads(threads)
    assert_all_launched(count, 20)


def test_launches_from_several_threads() -> None:
    ldtrefl.set_threads(2)
    failures: list[BaseException] = []

    def check() -> None:
        try:
            assert_all_launched(10_000, 200)
        except BaseException as error:
            failures.append(error)

    callers = [threading.Thread(target=check) for _ in range(3)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    assert not failures


def test_progress_reaches_the_end() -> None:
    seen: list[float] = []
    with launch.progress_to(lambda stage, fraction: seen.append(fraction)):
        assert_all_launched(1000, 1)
    assert len(seen) > 1 and seen == sorted(seen) and seen[-1] == 1.0
