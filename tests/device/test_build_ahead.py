"""Kernels that are foreseen: compiled by helpers when a first one had to be, waited for, never built twice."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import warp as wp

from ldtrefl.device import build_ahead, warp_abi

KERNELS = """
import os, sys, threading, time
import warp as wp
from ldtrefl.device import build_ahead, launch, warp_abi

def adder(number):
    @launch.kernel
    def add(first: int, values_out: wp.array(dtype=int)):
        i = first + wp.tid()
        values_out[i] = values_out[i] + number
    return add

def sum_of(kernels):
    device = launch.resolve_device(None)
    values = wp.zeros(1, dtype=int, device=device)
    for kernel in kernels:
        launch.launch(kernel, 1, [values], device)
    return int(values.numpy()[0])

def until_built():
    while build_ahead._state.compiler and (build_ahead._state.waiting or build_ahead._state.underway):
        time.sleep(0.01)

built = []
compile_for_cpu = warp_abi.compile_for_cpu
def recorded(kernel):
    built.append((kernel, threading.current_thread().name))
    compile_for_cpu(kernel)
warp_abi.compile_for_cpu = recorded
"""


def run(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a script that uses ``KERNELS``, with the kernel cache in a folder."""
    path = folder / "script.py"
    path.write_text(KERNELS + script)
    environment = os.environ | {"WARP_CACHE_PATH": str(folder / "kernels")}
    done = subprocess.run(
        [sys.executable, str(path)], capture_output=True, text=True, env=environment, timeout=100, check=False
    )
    assert done.returncode == 0, done.stderr
    return done


def test_helpers_compile_what_is_foreseen_once_a_kernel_had_to_be(tmp_path: Path) -> None:
    """The second time all are in the cache: nothing is begun."""
    script = """
first, *foreseen = [adder(number) for number in (1, 10, 100)]
build_ahead.foresee(foreseen, 2)
assert not built and sum_of([first]) == 1
until_built()
device = wp.get_device("cpu")
assert all(warp_abi.is_compiled(kernel, device) for kernel in foreseen)
assert sum_of([first, *foreseen]) == 111
print(len(built), {name for _, name in built} <= {"ldtrefl-compiler"})
"""
    assert run(script, tmp_path).stdout.split() == ["2", "True"]
    assert run(script, tmp_path).stdout.split()[0] == "0"


def test_one_thread_has_no_helpers(tmp_path: Path) -> None:
    script = """
build_ahead.foresee([adder(10)], 1)
assert sum_of([adder(1)]) == 1
time.sleep(0.2)
print(len(built))
"""
    assert run(script, tmp_path).stdout.split()[0] == "0"


def test_a_kernel_that_cannot_be_compiled_says_so_when_it_is_launched(tmp_path: Path) -> None:
    script = """
@launch.kernel
def broken(first: int, values_out: wp.array(dtype=int)):
    values_out[first + wp.tid()] = nothing_of_that_name
good = adder(10)
build_ahead.foresee([broken, good], 2)
sum_of([adder(1)])
until_built()
assert sum_of([good]) == 10
try:
    sum_of([broken])
except Exception as error:
    print("nothing_of_that_name" in str(error))
"""
    assert run(script, tmp_path).stdout.split() == ["True"]


def test_a_process_that_forks_meanwhile(tmp_path: Path) -> None:
    """The child compiles for itself; the parent's helpers go on."""
    script = """
kernels = [adder(number) for number in range(1, 7)]
build_ahead.foresee(kernels[1:], 2)
sum_of(kernels[:1])
child = os.fork()
if child == 0:
    launch.set_threads(1)
    os._exit(0 if sum_of(kernels) == 21 else 1)
until_built()
print(sum_of(kernels), os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    assert run(script, tmp_path).stdout.split() == ["21", "0"]


def test_a_launch_waits_for_a_kernel_that_is_begun_and_helps_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, finish, compiled = threading.Event(), threading.Event(), []

    def slow(kernel: str) -> None:
        if kernel == "slow":
            begun.set()
            assert finish.wait(60)
        compiled.append((kernel, threading.current_thread()))

    monkeypatch.setattr(build_ahead, "_state", build_ahead._State())
    monkeypatch.setattr(warp_abi, "compile_for_cpu", slow)
    names: list[wp.Kernel] = ["slow", "other", "launched"]
    build_ahead.foresee(names, 2)
    build_ahead.begin()
    assert begun.wait(60)
    build_ahead.wait_for(names[2])  # left to the caller at once
    caller = threading.Thread(target=build_ahead.wait_for, args=("slow",))
    caller.start()
    while not compiled:
        time.sleep(0.001)
    assert compiled == [("other", caller)] and caller.is_alive()
    finish.set()
    caller.join(60)
    assert not caller.is_alive()
    build_ahead.wait_for(names[0])
    assert [kernel for kernel, _ in compiled] == ["other", "slow"]


def test_nothing_is_begun_where_the_cache_cannot_be_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build_ahead, "_state", build_ahead._State())
    monkeypatch.setattr(warp_abi, "compile_for_cpu", lambda kernel: pytest.fail("compiled"))
    names: list[wp.Kernel] = ["a", "b"]
    build_ahead.foresee(names, 2)
    build_ahead.stop()
    build_ahead.begin()
    assert build_ahead._state.helpers == 0 and not build_ahead._state.waiting
