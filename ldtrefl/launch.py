"""The only place that launches kernels: devices, slices over CPU threads, stage timers, counters, progress.

Warp runs a CPU launch on one thread. So every kernel here takes ``first`` as its first parameter and works on item
``first + wp.tid()``: on the CPU a launch is cut into slices for a crew of threads (``crew.py``), on CUDA it is one
launch with ``first = 0``. No kernel lets two items write one place unless it says how that stays the same for every
slicing, so the bits do not depend on the number of threads.
"""

from __future__ import annotations

import functools
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import warp as wp

from ldtrefl.crew import Crew
from ldtrefl.errors import InputError
from ldtrefl.native import caught_stderr

wp.config.log_level = wp.LOG_ERROR

REPORTS = 32
"""Times that a launch reports how far it is, if anyone wants to know."""

KERNELS: list[wp.Kernel] = []
"""Every kernel defined so far. Each is a module of its own: it is compiled when it is first needed, and no sooner."""

NO_DRIVER = b"Could not find or load the NVIDIA CUDA driver"
"""What Warp says at its start on a machine without a GPU."""


@dataclass
class _State:
    """What one process shares."""

    threads: int = os.cpu_count() or 1
    crews: dict[int, Crew] = field(default_factory=dict)  # by number of threads
    observer: Callable[[str, float], None] | None = None
    stage: str = ""


_state = _State()


def kernel(function: Callable[..., None]) -> wp.Kernel:
    """Make ``function`` a Warp kernel: a module of its own, forward only (backward passes double compile time)."""
    made = wp.kernel(function, module="unique", enable_backward=False)
    KERNELS.append(made)
    return made


def set_threads(threads: int | None = None) -> None:
    """Use this many CPU threads from now on; ``None`` means all cores.

    Raises:
        InputError: ``threads`` is not a whole number of at least 1.
    """
    if threads is None:
        threads = os.cpu_count() or 1
    if not isinstance(threads, int) or isinstance(threads, bool) or not 1 <= threads <= 1024:
        raise InputError(f"threads must be a whole number from 1 to 1024, got {threads!r}")
    _state.threads = threads


def thread_count() -> int:
    """CPU threads in use."""
    return _state.threads


@functools.cache
def _start_warp() -> None:
    """Initialise Warp. Its native code warns of a missing CUDA driver on standard error, which is no news here."""
    with caught_stderr() as caught:
        wp.init()
        caught.seek(0)
        said = caught.read()
    for line in said.splitlines(keepends=True):
        if NO_DRIVER not in line:
            os.write(2, line)


def resolve_device(name: str | None) -> wp.Device:
    """The device called ``name`` ('cpu', 'cuda:0'); ``None`` means the CPU.

    Raises:
        InputError: there is no such device here.
    """
    _start_warp()
    try:
        return wp.get_device(name or "cpu")
    except Exception as error:
        known = ", ".join(str(device) for device in wp.get_devices())
        raise InputError(f"no device '{name}' (here: {known})") from error


@contextmanager
def progress_to(observer: Callable[[str, float], None]) -> Iterator[None]:
    """Report every finished part of a launch to ``observer(stage, fraction of the launch)`` inside this block."""
    before, _state.observer = _state.observer, observer
    try:
        yield
    finally:
        _state.observer = before


def launch(kernel: wp.Kernel, count: int, arguments: Sequence[Any], device: wp.Device) -> None:
    """Run ``kernel(first, *arguments)`` for ``count`` items, on the CPU in slices over the threads."""
    if count <= 0:
        return
    if not device.is_cpu:
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)
        return
    command = wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device, record_cmd=True)
    reports = 1 if _state.observer is None else min(count, REPORTS)
    for k in range(reports):
        first, end = (count * part // reports for part in (k, k + 1))
        _crew().launch(command, first, end - first)
        _report(end / count)


def launch_in_order(kernel: wp.Kernel, count: int, arguments: Sequence[Any], device: wp.Device) -> None:
    """Run ``kernel(first, *arguments)`` for ``count`` items, on the CPU one after another on one thread.

    For kernels whose items share memory. CUDA runs them at once, so such kernels use atomics all the same (Warp's
    atomics are plain additions on the CPU).
    """
    if count > 0:
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)


def _crew() -> Crew:
    if _state.threads not in _state.crews:
        _state.crews[_state.threads] = Crew(_state.threads)
    return _state.crews[_state.threads]


def _report(fraction: float) -> None:
    if _state.observer is not None:
        _state.observer(_state.stage, fraction)


@dataclass
class Stats:
    """What a frame cost: seconds per stage, and counts of what was done and what was skipped."""

    seconds: dict[str, float] = field(default_factory=dict)
    counters: dict[str, int] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str, device: wp.Device) -> Iterator[None]:
        """Add the time of this block to ``seconds[name]``, the device's work included."""
        outer, _state.stage = _state.stage, name
        _report(0.0)
        start = time.perf_counter()
        try:
            yield
            if device.is_cuda:
                wp.synchronize_device(device)
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
            _state.stage = outer

    def count(self, name: str, amount: int) -> None:
        """Add ``amount`` to ``counters[name]``."""
        self.counters[name] = self.counters.get(name, 0) + int(amount)
