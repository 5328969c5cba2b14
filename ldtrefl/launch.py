"""The only place that launches kernels: devices, slices over CPU threads, stage timers, counters, progress.

Warp runs a CPU launch on one thread but releases the interpreter lock while it does. So every kernel here takes
``first`` as its first parameter and works on item ``first + wp.tid()``: on the CPU a launch is cut into slices for a
thread pool, on CUDA it is one launch with ``first = 0``. No kernel lets two items write one place unless it says how
that stays the same for every slicing, so the bits do not depend on the number of threads.
"""

from __future__ import annotations

import functools
import itertools
import operator
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import warp as wp

from ldtrefl.errors import InputError

wp.config.log_level = wp.LOG_ERROR

MIN_SLICE = 2048
"""Items in a slice at least: a launch costs about 45 microseconds in Python, 2,048 rays a multiple of that."""

SLICES_PER_THREAD = 4
"""More slices than threads, so that a thread with cheap pixels takes over from one with dear pixels."""

KERNELS: list[wp.Kernel] = []
"""Every kernel defined so far. Each is a module of its own: it is compiled when it is first needed, and no sooner."""

NO_DRIVER = b"Could not find or load the NVIDIA CUDA driver"
"""What Warp says at its start on a machine without a GPU."""


@dataclass
class _State:
    """What one process shares."""

    threads: int = os.cpu_count() or 1
    pools: dict[int, ThreadPoolExecutor] = field(default_factory=dict)
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
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        with tempfile.TemporaryFile() as said:
            os.dup2(said.fileno(), 2)
            try:
                wp.init()
            finally:
                os.dup2(kept, 2)
            said.seek(0)
            for line in said.read().splitlines(keepends=True):
                if NO_DRIVER not in line:
                    os.write(2, line)
    finally:
        os.close(kept)


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
    slices = min(_state.threads * SLICES_PER_THREAD, -(-count // MIN_SLICE)) if is_cut else 1
    bounds = [count * i // slices for i in range(slices + 1)]
    _run(
        kernel,
        device,
        [(end - first, [first, *arguments]) for first, end in itertools.pairwise(bounds)],
    )


def launch_parts(kernel: wp.Kernel, count: int, arguments: Sequence[Any], device: wp.Device, parts: int = 0) -> None:
    """Run ``kernel(part, parts, *arguments)`` with ``count`` items for every part, the parts side by side.

    For kernels whose items share memory: item ``i`` of part ``p`` may write only what belongs to ``p``. Inside a part
    the CPU goes through the items in order, alone; CUDA runs them at once, so such kernels use atomics all the same
    (Warp's atomics are plain additions on the CPU). ``parts = 0`` lets the device choose: one a thread, one on CUDA.
    """
    if count <= 0:
        return
    parts = parts or (_state.threads if device.is_cpu else 1)
    if not device.is_cpu:
        for part in range(parts):
            wp.launch(kernel, dim=count, inputs=[part, parts, *arguments], device=device)
        return
    _run(kernel, device, [(count, [part, parts, *arguments]) for part in range(parts)])


def _run(kernel: wp.Kernel, device: wp.Device, slices: list[tuple[int, list[Any]]]) -> None:
    """Work off the slices, (items, arguments) each, that differ in their first argument alone."""
    # Recording loads the kernel's module, which is not safe from several threads: once here, before any other starts.
    count, arguments = slices[0]
    command = wp.launch(kernel, dim=count, inputs=arguments, device=device, record_cmd=True)
    waiting = iter(slices[1:])  # taken from by all threads, one slice at a time
    workers = min(_state.threads, len(slices)) - 1
    helpers = [_pool().submit(_work, kernel, device, waiting) for _ in range(workers)]
    command.launch()
    for count, arguments in waiting:
        _report(1.0 - operator.length_hint(waiting) / len(slices))
        command.set_dim(count)
        command.set_param_at_index(0, arguments[0])
        command.launch()
    for helper in helpers:
        helper.result()
    _report(1.0)


def _work(kernel: wp.Kernel, device: wp.Device, waiting: Iterator[tuple[int, list[Any]]]) -> None:
    """Launch slices until none waits. The arguments are packed once, which takes ten times a launch."""
    command = None
    for count, arguments in waiting:
        if command is None:
            command = wp.launch(kernel, dim=count, inputs=arguments, device=device, record_cmd=True)
        else:
            command.set_dim(count)
            command.set_param_at_index(0, arguments[0])
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
