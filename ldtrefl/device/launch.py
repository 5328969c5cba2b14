"""The only place that launches kernels: devices, slices over CPU threads, stage timers, counters, progress.

Warp runs a CPU launch on one thread. So every kernel here takes ``first`` as its first parameter and works on item
``first + wp.tid()``: on the CPU a launch is cut into slices for a crew of threads (``crew.py``), on CUDA it is one
launch with ``first = 0``. No kernel lets two items write one place unless it says how that stays the same for every
slicing, so the bits do not depend on the number of threads.
"""

from __future__ import annotations

import functools
import operator
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, SupportsIndex

import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.device import kernel_cache
from ldtrefl.device.cpu_threads import Crew, alone, recorded, why_not_native
from ldtrefl.device.python_pool import Pool

REPORTS = 32
"""Times that a launch reports how far it is, if anyone wants to know."""

KERNELS: list[wp.Kernel] = []
"""Every kernel defined so far. Each is a module of its own: it is compiled when it is first needed, and no sooner."""

MOST_ITEMS = 2**31 - 1
"""Items of a launch: their numbers are int32."""

MOST_THREADS = 1024


@dataclass
class _State:
    """What one process shares."""

    threads: int = os.cpu_count() or 1
    crews: dict[int, Crew | Pool] = field(default_factory=dict)  # by number of threads
    lock: threading.Lock = field(default_factory=threading.Lock)  # to make a crew
    defining: threading.RLock = field(default_factory=threading.RLock)  # to define kernels


class _Watch(threading.local):
    """Who wants to know how far the launches of this thread are."""

    observer: Callable[[str, float], None] | None = None
    stage: str = ""


_state = _State()
_watch = _Watch()


def _after_fork_in_child() -> None:
    # Threads do not exist in a forked process: it makes its own at its first launch.
    _state.crews.clear()
    _state.lock = threading.Lock()
    _state.defining = threading.RLock()


os.register_at_fork(after_in_child=_after_fork_in_child)


def kernel(function: Callable[..., None]) -> wp.Kernel:
    """Make ``function`` a Warp kernel: a module of its own, forward only (backward passes double compile time)."""
    made = wp.kernel(function, module="unique", enable_backward=False)
    KERNELS.append(made)
    return made


def once(make: Callable[..., Any]) -> Callable[..., Any]:
    """A function that makes kernels, or what they are made of: for equal arguments once, whichever thread asks first.

    Two kernels of one name would share a module of Warp's, and the second would have the first's code unloaded.
    """
    cached = functools.cache(make)

    @functools.wraps(make)
    def made(*arguments: Any) -> Any:
        with _state.defining:
            return cached(*arguments)

    return made


def set_threads(threads: SupportsIndex | None = None) -> None:
    """Use this many CPU threads from now on; ``None`` means all cores.

    Raises:
        InputError: ``threads`` is not a whole number from 1 to 1024.
    """
    try:
        number = (os.cpu_count() or 1) if threads is None else operator.index(threads)
    except TypeError:
        number = 0
    if isinstance(threads, bool) or not 1 <= number <= MOST_THREADS:
        raise InputError(f"threads must be a whole number from 1 to {MOST_THREADS}, got {threads!r}")
    _state.threads = number


def thread_count() -> int:
    """CPU threads in use."""
    return _state.threads


def threading_note() -> str | None:
    """A line if threads share launches in a slower way, because this version of Warp is not known well enough."""
    resolve_device(None)
    reason = why_not_native()
    if reason is None:
        return None
    return (
        f"threads: launches are shared out in Python, which is slower, as Warp {wp.__version__} is not known: {reason}"
    )


def resolve_device(name: str | None) -> wp.Device:
    """The device called ``name`` ('cpu', 'cuda:0'); ``None`` means the CPU.

    Raises:
        InputError: there is no such device here, or no folder that compiled kernels can be written to.
    """
    kernel_cache.start_warp()
    try:
        return wp.get_device(name or "cpu")
    except Exception as error:
        known = ", ".join(str(device) for device in wp.get_devices())
        raise InputError(f"no device '{name}' (here: {known})") from error


@contextmanager
def progress_to(observer: Callable[[str, float], None]) -> Iterator[None]:
    """Report the launches of this thread to ``observer(stage, fraction of the launch)`` inside this block."""
    before, _watch.observer = _watch.observer, observer
    try:
        yield
    finally:
        _watch.observer = before


def launch(kernel: wp.Kernel, count: int, arguments: Sequence[Any], device: wp.Device) -> None:
    """Run ``kernel(first, *arguments)`` for ``count`` items, on the CPU in slices over the threads.

    Raises:
        InputError: there are more items than int32 can number, or the kernel must be compiled and no folder can be
            written.
    """
    if count <= 0:
        return
    _check_count(count)
    if not device.is_cpu:
        kernel_cache.load(kernel, device)
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)
        return
    if _state.threads == 1:
        run = alone(recorded(kernel, count, arguments, device))
    else:
        run = _crew().prepared(kernel, count, arguments, device)
    reports = 1 if _watch.observer is None else min(count, REPORTS)
    for k in range(reports):
        first, end = (count * part // reports for part in (k, k + 1))
        run(first, end - first)
        _report(end / count)


def launch_in_order(kernel: wp.Kernel, count: int, arguments: Sequence[Any], device: wp.Device) -> None:
    """Run ``kernel(first, *arguments)`` for ``count`` items, on the CPU one after another on one thread.

    For kernels whose items share memory. CUDA runs them at once, so such kernels use atomics all the same (Warp's
    atomics are plain additions on the CPU). Raises as :func:`launch` does.
    """
    if count > 0:
        _check_count(count)
        kernel_cache.load(kernel, device)
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)


def _check_count(count: int) -> None:
    if count > MOST_ITEMS:
        raise InputError(
            f"{count} items at once, at most {MOST_ITEMS} can be numbered: take a smaller scene or resolution"
        )


def _crew() -> Crew | Pool:
    threads = _state.threads
    crew = _state.crews.get(threads)
    if crew is None:
        with _state.lock:
            crew = _state.crews.get(threads)
            if crew is None:
                crew = Pool(threads) if why_not_native() else Crew(threads)
                _state.crews[threads] = crew
    return crew


def _report(fraction: float) -> None:
    if _watch.observer is not None:
        _watch.observer(_watch.stage, fraction)


@dataclass
class Stats:
    """What a frame cost: seconds per stage, and counts of what was done and what was skipped."""

    seconds: dict[str, float] = field(default_factory=dict)
    counters: dict[str, int] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str, device: wp.Device) -> Iterator[None]:
        """Add the time of this block to ``seconds[name]``, the device's work included."""
        outer, _watch.stage = _watch.stage, name
        _report(0.0)
        start = time.perf_counter()
        try:
            yield
            if device.is_cuda:
                wp.synchronize_device(device)
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
            _watch.stage = outer

    def count(self, name: str, amount: int) -> None:
        """Add ``amount`` to ``counters[name]``."""
        self.counters[name] = self.counters.get(name, 0) + int(amount)
