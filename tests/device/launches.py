"""What tests of launches share: a kernel that counts, and the check that every item ran once."""

import subprocess
import sys
import threading

import numpy as np
import warp as wp

from ldtrefl.device import launch


@launch.kernel
def add_number(first: int, numbers: wp.array(dtype=int)):
    """Each thread adds its item's number, from 1, to its item."""
    i = first + wp.tid()
    numbers[i] += i + 1


def assert_all_launched(count: int, times: int) -> None:
    """Every item of ``times`` launches ran once, and none beyond."""
    device = launch.resolve_device(None)
    numbers = wp.zeros(count + 1, dtype=int, device=device)
    for _ in range(times):
        launch.launch(add_number, count, [numbers], device)
    np.testing.assert_array_equal(numbers.numpy(), [*(times * np.arange(1, count + 1)), 0])


def assert_all_launched_by_threads() -> None:
    """The same for launches from three threads at once."""
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


def run_script(script: str, *arguments: str, seconds: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Run a script in a process of its own."""
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)
