"""Launches over a team of native threads: every item once, whoever works at it; forks, and the end of the program."""

import os
import threading

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.device import cpu_threads, launch
from ldtrefl.device.cpu_threads import ThreadTeam
from tests.device.launches import add_number, assert_all_launched, assert_all_launched_by_threads, run_script

big_vector = wp.types.vector(length=256, dtype=wp.float64)


@wp.struct
class Large:
    """6 kB: more than fits on a team's board."""

    a: big_vector
    b: big_vector
    c: big_vector


@launch.kernel
def add_large(first: int, large: Large, numbers: wp.array(dtype=wp.float64)):
    """Each thread adds a member of the last vector to its item."""
    i = first + wp.tid()
    numbers[i] += large.c[i % 256]


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
@pytest.mark.parametrize("count", [1, 2, 63, 129, 1000, 100_003])
def test_every_item_once(threads: int, count: int) -> None:
    ldtrefl.set_threads(threads)
    assert_all_launched(count, 20)


def test_launches_from_several_threads() -> None:
    ldtrefl.set_threads(2)
    assert_all_launched_by_threads()


def test_arguments_larger_than_the_board() -> None:
    ldtrefl.set_threads(2)
    device = launch.resolve_device(None)
    large = Large()
    large.c = big_vector(*range(256))
    numbers = wp.zeros(1000, dtype=wp.float64, device=device)
    launch.launch(add_large, 1000, [large, numbers], device)
    np.testing.assert_array_equal(numbers.numpy(), np.arange(1000) % 256)


def test_a_team_that_has_ended_launches_on_one_thread() -> None:
    device = launch.resolve_device(None)
    team = ThreadTeam(2)
    numbers = wp.zeros(1000, dtype=int, device=device)
    run = team.prepare(add_number, [numbers], device)
    helpers = threading.active_count()
    team.end()
    assert threading.active_count() == helpers - 1
    run(0, 1000)
    np.testing.assert_array_equal(numbers.numpy(), np.arange(1, 1001))


def test_stopping_waits_for_the_helpers(monkeypatch: pytest.MonkeyPatch) -> None:
    launch.resolve_device(None)
    stopped = ThreadTeam(2)
    presses = []

    def sleep(seconds: float) -> None:
        presses.append(seconds)
        if len(presses) == 3:
            stopped._board.finished.value = 5
            return
        raise KeyboardInterrupt

    monkeypatch.setattr(cpu_threads.time, "sleep", sleep)
    stopped._board.finished.value = 0
    with pytest.raises(KeyboardInterrupt):
        stopped._wait_for(5)
    assert len(presses) == 3 and stopped._board.finished.value == 5
    stopped.end()


RAYS = """
import os, signal, sys, threading, time
import numpy as np
import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene import shapes
ldtrefl.set_threads(2)
ball = shapes.make("sphere", {"segments": [16, 8]})
caster = ldtrefl.Raycaster(ball.vertices, ball.faces)
origins = np.tile([[0.0, 0.0, 5.0]], (5000, 1))
def trace():
    return caster.trace(origins, np.tile([[0.01, 0.02, -1.0]], (5000, 1))).t
truth = trace()
"""

FORK = """
signal.alarm(60)
child = os.fork()
if child == 0:
    before = threading.active_count()
    same = all((trace() == truth).all() for _ in range(20))
    sys.exit(0 if same and np.isfinite(truth).all() and before == 1 and threading.active_count() == 2 else 5)
status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
sys.exit(status if (trace() == truth).all() else 6)
"""

BUSY_FORKS = """
signal.alarm(60)
def go():
    while True:
        trace()
for _ in range(2):
    threading.Thread(target=go, daemon=True).start()
for _ in range(5):
    child = os.fork()
    if child == 0:
        os._exit(0 if (trace() == truth).all() else 5)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status:
        sys.exit(status)
"""

EXIT = """
def go():
    while True:
        trace()
for _ in range(3):
    threading.Thread(target=go, daemon=True).start()
time.sleep(0.2)
"""


def test_a_forked_process_has_helpers_of_its_own() -> None:
    done = run_script(RAYS + FORK)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_forks_while_other_threads_launch() -> None:
    done = run_script(RAYS + BUSY_FORKS)
    assert done.returncode == 0, done.stderr


def test_the_end_while_threads_launch() -> None:
    done = run_script(RAYS + EXIT)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
