"""Launches over CPU threads: every item once, whoever works at it, with Warp's internals and without."""

import ctypes
import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import warp as wp

import ldtrefl
from ldtrefl.cli.commands import main
from ldtrefl.device import cpu_threads, kernel_cache, launch, python_pool, warp_abi
from tests.conftest import SMALL_SCENE


@launch.kernel
def add_number(first: int, numbers: wp.array(dtype=int)):
    i = first + wp.tid()
    numbers[i] += i + 1


@launch.kernel
def like_tried(first: int, tried: cpu_threads.Tried, values_out: wp.array(dtype=float)):
    i = first + wp.tid()
    values_out[i] = values_out[i] + 1.0


big_vector = wp.types.vector(length=256, dtype=wp.float64)


@wp.struct
class Large:
    """6 kB: more than fits on a crew's board."""

    a: big_vector
    b: big_vector
    c: big_vector


@launch.kernel
def add_large(first: int, large: Large, numbers: wp.array(dtype=wp.float64)):
    i = first + wp.tid()
    numbers[i] += large.c[i % 256]


def assert_all_launched(count: int, times: int) -> None:
    device = launch.resolve_device(None)
    numbers = wp.zeros(count + 1, dtype=int, device=device)
    for _ in range(times):
        launch.launch(add_number, count, [numbers], device)
    np.testing.assert_array_equal(numbers.numpy(), [*(times * np.arange(1, count + 1)), 0])


@pytest.fixture
def fresh_crews(monkeypatch: pytest.MonkeyPatch) -> None:
    """No crew has been made yet."""
    monkeypatch.setattr(launch._state, "crews", {})


@pytest.fixture
def unknown_warp(monkeypatch: pytest.MonkeyPatch, fresh_crews: None) -> None:
    """A version of Warp whose layout is unknown."""
    monkeypatch.setattr(cpu_threads, "_tried", cpu_threads._Trial())
    monkeypatch.setattr(warp_abi, "unknown_layout", lambda command, folders: "[made up]")


def run_script(script: str, *arguments: str, seconds: float = 120.0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
@pytest.mark.parametrize("count", [1, 2, 63, 129, 1000, 100_003])
def test_every_item_once(threads: int, count: int) -> None:
    ldtrefl.set_threads(threads)
    assert_all_launched(count, 20)


def test_launches_from_several_threads() -> None:
    ldtrefl.set_threads(2)
    assert_all_launched_by_threads()


def assert_all_launched_by_threads() -> None:
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


def test_this_warp_is_known() -> None:
    assert cpu_threads.why_not_native() is None
    assert launch.threading_note() is None


@pytest.mark.parametrize("count", [1, 2, 7, 129, 100_003])
def test_every_item_once_with_an_unknown_warp(unknown_warp: None, count: int) -> None:
    for threads in (2, 3):
        ldtrefl.set_threads(threads)
        assert_all_launched(count, 5)
        assert isinstance(launch._state.crews[threads], python_pool.Pool)


def test_several_threads_with_an_unknown_warp(unknown_warp: None) -> None:
    ldtrefl.set_threads(2)
    assert_all_launched_by_threads()


def test_an_unknown_warp_gives_the_same_bits(
    unknown_warp: None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE)
    scene = ldtrefl.load_scene(path)
    ldtrefl.set_threads(1)
    alone = ldtrefl.render(scene)
    ldtrefl.set_threads(2)
    pooled = ldtrefl.render(scene)
    assert isinstance(launch._state.crews[2], python_pool.Pool)
    assert alone.reflector_mask.any() and alone.image.tobytes() == pooled.image.tobytes()
    assert main(["info", str(path)]) == 0
    said = [line for line in capfd.readouterr().out.splitlines() if "threads: " in line]
    assert len(said) == 1 and "[made up]" in said[0]


def test_what_a_pool_raises_is_raised(unknown_warp: None) -> None:
    launch.resolve_device(None)
    pool = python_pool.Pool(2)
    run = pool.prepared(add_number, 100, ["not an array"], wp.get_device("cpu"))
    with pytest.raises(Exception, match="array"):
        run(0, 100)


class OtherBounds(ctypes.Structure):
    """Launch bounds with one member more."""

    _fields_ = (*warp_abi.BOUNDS_FIELDS, ("stride", ctypes.c_size_t))


def with_another(command: Any, **replaced: Any) -> Any:
    """A recorded launch as a Warp of another layout might give it."""
    names = ("kernel", "params", "hooks", "block_dim")
    return SimpleNamespace(**{name: getattr(command, name) for name in names} | replaced)


def test_unknown_layouts_are_not_called(tmp_path: Path) -> None:
    device = launch.resolve_device(None)
    command = cpu_threads.recorded(add_number, 10, [wp.zeros(10, dtype=int, device=device)], device)
    folders = kernel_cache.folders()
    assert warp_abi.unknown_layout(command, folders) is None
    bounds, *arguments = command.params
    name = command.kernel.module.get_module_identifier(block_dim=1)
    source = next(path for path in (folder / name / f"{name}.cpp" for folder in folders) if path.exists()).read_text()
    (tmp_path / name).mkdir()
    (tmp_path / name / f"{name}.cpp").write_text(re.sub(r"(_cpu_forward\()", r"\1void *workspace, ", source))
    unknown = {
        "other bounds": with_another(command, params=[OtherBounds(), *arguments]),
        "no bounds": with_another(command, params=arguments),
        "hidden argument": with_another(command, params=[bounds, *arguments, ctypes.c_void_p()]),
        "long numbers": with_another(command, params=[bounds, ctypes.c_int64(0), *arguments[1:]]),
        "blocks": with_another(command, block_dim=256),
        "no hooks": with_another(command, hooks=None),
        "no entry": with_another(command, hooks=SimpleNamespace(forward=None)),
        "renamed": with_another(command, hooks=SimpleNamespace(run=command.hooks.forward)),
    }
    for what, other in unknown.items():
        assert warp_abi.unknown_layout(other, folders), what
    assert warp_abi.unknown_layout(command, [tmp_path]) == "a kernel's entry point takes other arguments"
    assert warp_abi.unknown_layout(command, [tmp_path / "none"])


def test_a_wrong_call_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    device = launch.resolve_device(None)
    wrong = cpu_threads.recorded(like_tried, 1, [cpu_threads.Tried(), wp.zeros(1, dtype=float, device=device)], device)
    address = warp_abi.entry_point(wrong)
    monkeypatch.setattr(cpu_threads, "_tried", cpu_threads._Trial())
    monkeypatch.setattr(warp_abi, "entry_point", lambda command: address)
    assert "other values" in str(cpu_threads.why_not_native())


def test_what_raises_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    launch.resolve_device(None)
    monkeypatch.setattr(cpu_threads, "_tried", cpu_threads._Trial())
    monkeypatch.delattr(warp_abi, "NativeCall")
    assert "NativeCall" in str(cpu_threads.why_not_native())


def test_structs_without_their_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    device = launch.resolve_device(None)
    structs = []
    for k in range(3):
        one = cpu_threads.Tried()
        one.flag, one.offset, one.scale = wp.uint8(k), wp.float64(k + 0.25), wp.vec3(k, k + 1, k + 2)
        one.values = wp.zeros(4 + k, dtype=float, device=device)
        structs.append(one)
    public = wp.array(structs, dtype=cpu_threads.Tried, device=device).numpy()
    made = warp_abi.array_of_structs(structs, cpu_threads.Tried, device)
    for name in ("flag", "offset", "scale"):
        np.testing.assert_array_equal(made.numpy()[name], public[name])
    np.testing.assert_array_equal(made.numpy()["values"]["data"], public["values"]["data"])
    assert warp_abi.array_bytes(made) == made.numpy().nbytes
    assert len(warp_abi.array_of_structs([], cpu_threads.Tried, device)) == 0


def test_arguments_larger_than_the_board() -> None:
    ldtrefl.set_threads(2)
    device = launch.resolve_device(None)
    large = Large()
    large.c = big_vector(*range(256))
    numbers = wp.zeros(1000, dtype=wp.float64, device=device)
    launch.launch(add_large, 1000, [large, numbers], device)
    np.testing.assert_array_equal(numbers.numpy(), np.arange(1000) % 256)


def test_items_that_int32_cannot_number() -> None:
    device = launch.resolve_device(None)
    numbers = wp.zeros(1, dtype=int, device=device)
    for start in (launch.launch, launch.launch_in_order):
        with pytest.raises(ldtrefl.InputError, match=str(2**31 - 1)):
            start(add_number, 2**31, [numbers], device)


def test_numbers_of_threads() -> None:
    for number in (2, np.int64(2), np.uint8(2)):
        ldtrefl.set_threads(number)
        assert launch.thread_count() == 2 and type(launch.thread_count()) is int
    for wrong in (0, -1, 1025, 10**30, 2.0, "2", True, np.bool_(True), np.float64(2.0), [2]):
        with pytest.raises(ldtrefl.InputError, match="whole number from 1 to 1024"):
            ldtrefl.set_threads(wrong)  # type: ignore[arg-type]


def test_one_crew_for_all_who_launch_first(fresh_crews: None, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    class Slow(cpu_threads.Crew):
        def __init__(self, threads: int) -> None:
            made.append(self)
            time.sleep(0.05)
            super().__init__(threads)

    monkeypatch.setattr(launch, "Crew", Slow)
    ldtrefl.set_threads(2)
    callers = [threading.Thread(target=assert_all_launched, args=(1000, 5)) for _ in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    assert len(made) == 1
    made[0].end()


@pytest.mark.parametrize("given", [0, 1])
@pytest.mark.parametrize("kind", [cpu_threads.Crew, python_pool.Pool])
def test_a_system_that_gives_no_more_threads(
    kind: type[cpu_threads.Crew] | type[python_pool.Pool],
    given: int,
    fresh_crews: None,
    monkeypatch: pytest.MonkeyPatch,
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
    launch._state.crews[4] = kind(4)
    assert_all_launched(10_000, 5)
    assert len(started) == given


def test_stopping_waits_for_the_helpers(monkeypatch: pytest.MonkeyPatch) -> None:
    launch.resolve_device(None)
    stopped = cpu_threads.Crew(2)
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


def test_progress_reaches_the_end() -> None:
    seen: list[float] = []
    with launch.progress_to(lambda stage, fraction: seen.append(fraction)):
        assert_all_launched(1000, 1)
    assert len(seen) > 1 and seen == sorted(seen) and seen[-1] == 1.0


def test_progress_is_of_the_thread_that_asks() -> None:
    seen: list[float] = []
    with launch.progress_to(lambda stage, fraction: seen.append(fraction)):
        other = threading.Thread(target=assert_all_launched, args=(1000, 1))
        other.start()
        other.join()
    assert not seen


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
