"""The only place that launches kernels: devices, slices over CPU threads, stage timers, counters, progress.

Warp runs a CPU launch on one thread but releases the interpreter lock while it does. So every kernel here takes
``first`` as its first parameter and works on item ``first + wp.tid()``: on the CPU a launch is cut into slices for a
thread pool, on CUDA it is one launch with ``first = 0``. No kernel lets two items write one place unless it says how
that stays the same for every slicing, so the bits do not depend on the number of threads.
"""

from __future__ import annotations

import copy
import functools
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import warp as wp

from ldtrefl.errors import InputError
from ldtrefl.native import caught_stderr

wp.config.log_level = wp.LOG_ERROR

SHORTEST_SLICE = 200e-6
"""Seconds that a slice takes at least, going by the kernel's last launch: to wake a thread, or to pass on the
interpreter lock, takes 50 to 100 microseconds."""

SHARE = 1.5
"""A slice is this part of a thread's share of what is left: long ones first, which cost few launches, short ones at the
end, so that all threads end together whatever their pixels cost. Of 1.3, 1.5, 2, 4 and 8 the first two are the fastest
by 2%; with 1 one thread waits for the other."""

KERNELS: list[wp.Kernel] = []
"""Every kernel defined so far. Each is a module of its own: it is compiled when it is first needed, and no sooner."""

NO_DRIVER = b"Could not find or load the NVIDIA CUDA driver"
"""What Warp says at its start on a machine without a GPU."""


@dataclass
class _State:
    """What one process shares."""

    threads: int = os.cpu_count() or 1
    pools: dict[int, ThreadPoolExecutor] = field(default_factory=dict)
    seconds_per_item: dict[wp.Kernel, float] = field(default_factory=dict)  # of each kernel's last launch
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
    """Report every finished slice to ``observer(stage, fraction of the launch)`` inside this block."""
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
    is_cut = _state.threads > 1 or _state.observer is not None
    slices = list(_slices(count, _shortest_slice(kernel))) if is_cut else [(0, count)]
    _run(kernel, device, arguments, slices)


def _shortest_slice(kernel: wp.Kernel) -> int:
    """Items in a slice at least; 1 where nothing is known of the kernel yet."""
    return max(1, int(SHORTEST_SLICE / _state.seconds_per_item.get(kernel, SHORTEST_SLICE)))


def _slices(count: int, least: int) -> Iterator[tuple[int, int]]:
    """(first, items) of slices that become shorter towards the end."""
    first = 0
    while first < count:
        items = max(least, int((count - first) / (SHARE * _state.threads)))
        # A rest shorter than a slice goes with the last one.
        items = items if first + items + least <= count else count - first
        yield first, items
        first += items


def part_count(kernel: wp.Kernel, count: int, device: wp.Device) -> int:
    """Parts for :func:`launch_parts`: one a thread; one where that would take longer, and on CUDA."""
    return _state.threads if device.is_cpu and count >= 2 * _shortest_slice(kernel) else 1


def launch_parts(kernel: wp.Kernel, count: int, arguments: Sequence[Any], device: wp.Device, parts: int) -> None:
    """Run ``kernel(part, *arguments)`` with ``count`` items for each of ``parts`` parts, the parts side by side.

    For kernels whose items share memory: item ``i`` of part ``p`` may write only what belongs to ``p``. Inside a part
    the CPU goes through the items in order, alone; CUDA has one part and runs its items at once, so such kernels use
    atomics all the same (Warp's atomics are plain additions on the CPU).
    """
    if count <= 0:
        return
    if not device.is_cpu:
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)
        return
    _run(kernel, device, arguments, [(part, count) for part in range(parts)])


def _run(kernel: wp.Kernel, device: wp.Device, arguments: Sequence[Any], slices: list[tuple[int, int]]) -> None:
    """Work off the slices: (first argument, items) each."""
    # Recording loads the kernel's module, which is not safe from several threads: once here, before any other starts.
    first, items = slices[0]
    command = wp.launch(kernel, dim=items, inputs=[first, *arguments], device=device, record_cmd=True)
    waiting = iter(slices[1:])  # taken from by all threads, one slice at a time
    workers = min(_state.threads, len(slices)) - 1
    helpers = [_pool().submit(_work, command, waiting) for _ in range(workers)]
    start, done = time.perf_counter(), items
    command.launch()
    for first, items in waiting:
        _report(first / (slices[-1][0] + 1))
        _relaunch(command, first, items)
        done += items
    _state.seconds_per_item[kernel] = (time.perf_counter() - start) / done
    for helper in helpers:
        helper.result()
    _report(1.0)


def _work(recorded: wp.Launch, waiting: Iterator[tuple[int, int]]) -> None:
    """Launch slices until none waits, by a copy of the command: to record another takes ten times a launch."""
    command = copy.copy(recorded)
    command.params = list(recorded.params)
    for first, items in waiting:
        _relaunch(command, first, items)


def _relaunch(command: wp.Launch, first: int, items: int) -> None:
    command.set_dim(items)
    command.set_param_at_index(0, first)
    command.launch()


def _pool() -> ThreadPoolExecutor:
    if _state.threads not in _state.pools:
        _state.pools[_state.threads] = ThreadPoolExecutor(_state.threads, thread_name_prefix="ldtrefl")
    return _state.pools[_state.threads]


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
