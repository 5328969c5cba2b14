"""Launches: numbers of threads and items, one team for all who launch first, and what the system refuses."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.device.cpu_threads import ThreadTeam
from ldtrefl.device.python_threads import PythonThreads
from tests.device.launches import add_number, assert_all_launched


@pytest.mark.parametrize("start", [launch.launch, launch.launch_in_order])
def test_items_that_int32_cannot_number(start: Callable[..., None]) -> None:
    device = launch.resolve_device(None)
    numbers = wp.zeros(1, dtype=int, device=device)
    with pytest.raises(ldtrefl.InputError, match=str(2**31 - 1)):
        start(add_number, 2**31, [numbers], device)


@pytest.mark.parametrize("start", [launch.launch, launch.launch_in_order])
def test_no_items_launch_nothing(start: Callable[..., None]) -> None:
    device = launch.resolve_device(None)
    numbers = wp.zeros(2, dtype=int, device=device)
    for count in (0, -1):
        start(add_number, count, [numbers], device)
        np.testing.assert_array_equal(numbers.numpy(), [0, 0])
    start(add_number, 1, [numbers], device)
    np.testing.assert_array_equal(numbers.numpy(), [1, 0])


def test_numbers_of_threads() -> None:
    for number in (2, np.int64(2), np.uint8(2)):
        ldtrefl.set_threads(number)
        assert launch.thread_count() == 2 and type(launch.thread_count()) is int
    for wrong in (0, -1, 1025, 10**30, 2.0, "2", True, np.bool_(True), np.float64(2.0), [2]):
        with pytest.raises(ldtrefl.InputError, match="whole number from 1 to 1024"):
            ldtrefl.set_threads(wrong)  # type: ignore[arg-type]


def test_a_device_that_is_not_here() -> None:
    with pytest.raises(ldtrefl.InputError, match=r"no device 'abacus' \(here: .*cpu"):
        launch.resolve_device("abacus")


def test_this_warp_is_known() -> None:
    assert launch.threading_note() is None


def test_one_team_for_all_who_launch_first(no_teams: None, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    class Slow(ThreadTeam):
        def __init__(self, threads: int) -> None:
            made.append(self)
            time.sleep(0.05)
            super().__init__(threads)

    monkeypatch.setattr(launch, "ThreadTeam", Slow)
    ldtrefl.set_threads(2)
    callers = [threading.Thread(target=assert_all_launched, args=(1000, 5)) for _ in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    assert len(made) == 1
    made[0].end()


@pytest.mark.parametrize("given", [0, 1])
@pytest.mark.parametrize("kind", [ThreadTeam, PythonThreads])
def test_a_system_that_gives_no_more_threads(
    kind: type[ThreadTeam] | type[PythonThreads], given: int, no_teams: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    launch.resolve_device(None)
    start, started = threading.Thread.start, []

    def start_some(thread: threading.Thread) -> None:
        if len(started) == given:
            raise RuntimeError("can't start new thread")
        started.append(thread)
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", start_some)
    ldtrefl.set_threads(4)
    launch._state.teams[4] = kind(4)
    assert_all_launched(10_000, 5)
    assert len(started) == given


def test_equal_arguments_make_one_kernel() -> None:
    made = []

    @launch.once
    def make(name: str) -> str:
        made.append(name)
        return name * 2

    assert [make("a"), make("b"), make("a")] == ["aa", "bb", "aa"] and made == ["a", "b"]


def adder(number: int) -> wp.Kernel:
    """A kernel that adds ``number``, made by a function as kernels over a tracer are."""

    @launch.kernel
    def add(first: int, values_out: wp.array(dtype=float)):
        """Each thread adds a number to one value."""
        i = first + wp.tid()
        values_out[i] = values_out[i] + float(number)

    return add


def test_kernels_of_one_name_are_told_apart_the_same_way_in_every_process() -> None:
    """By what they take from the function that makes them: Warp would unload one for the other, or compile it anew."""
    device = launch.resolve_device(None)
    kernels = [adder(1), adder(10), adder(1)]
    values = wp.zeros(3, dtype=float, device=device)
    for kernel in [*kernels, *kernels]:
        launch.launch(kernel, 3, [values], device)
    np.testing.assert_array_equal(values.numpy(), [24.0, 24.0, 24.0])
    names = [kernel.module.name for kernel in kernels]
    assert len(set(names)) == 3 and names[2] == f"{names[0]}_2"
    code = "from tests.device.test_launch import adder; print(*(adder(k).module.name for k in (10, 1)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [names[1], names[0]]


def test_a_kernel_is_not_gone_through_before_it_is_needed() -> None:
    """What it calls is hashed once, when it is loaded."""
    kernel = adder(100)
    assert not kernel.module.hashers and kernel.hash is None
    device = launch.resolve_device(None)
    launch.launch(kernel, 1, [wp.zeros(1, dtype=float, device=device)], device)
    assert list(kernel.module.hashers) == [1]
