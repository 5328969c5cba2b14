"""The only place that launches kernels: kernels defined, the device, the number of CPU threads, launches.

Warp runs a CPU launch on one thread. So every kernel of the package takes ``first`` as its first parameter and works on
item ``first + wp.tid()``: on the CPU a launch is cut into slices for a team of threads (``cpu_threads.py``), on CUDA it
is one launch with ``first = 0``. No kernel lets two items write one place unless it says how that stays the same for
every slicing, so the bits do not depend on the number of threads.
"""

from __future__ import annotations

import functools
import hashlib
import operator
import os
import threading
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from typing import SupportsIndex, TypeVar, cast

import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.device import kernel_cache, progress
from ldtrefl.device.cpu_threads import ThreadTeam
from ldtrefl.device.python_threads import PythonThreads
from ldtrefl.device.recorded_launch import on_this_thread, record_launch
from ldtrefl.device.thread_self_test import why_not_native

REPORTS = 32
"""Times that a launch reports how far it is, if anyone watches (``progress.py``)."""

KERNELS: list[wp.Kernel] = []
"""Every kernel defined so far. Each is a module of its own: it is compiled when it is first needed, and no sooner."""

MOST_ITEMS = 2**31 - 1
"""Items of a launch at most: their numbers are int32."""

MOST_THREADS = 1024
"""CPU threads that may be asked for."""

Make = TypeVar("Make", bound=Callable[..., object])


@dataclass
class _State:
    """What one process shares."""

    threads: int = os.cpu_count() or 1
    teams: dict[int, ThreadTeam | PythonThreads] = field(default_factory=dict)  # by number of threads
    names: dict[str, int] = field(default_factory=dict)  # of kernels' modules, and how many asked for each
    lock: threading.Lock = field(default_factory=threading.Lock)  # to make a team
    defining: threading.RLock = field(default_factory=threading.RLock)  # to define kernels


_state = _State()


def _after_fork_in_child() -> None:
    # Threads do not exist in a forked process: it makes its own at its first launch.
    _state.teams.clear()
    _state.lock = threading.Lock()
    _state.defining = threading.RLock()


os.register_at_fork(after_in_child=_after_fork_in_child)


def kernel(function: Callable[..., None]) -> wp.Kernel:
    """Make ``function`` a Warp kernel: a module of its own, forward only (backward passes double compile time).

    The module is named here. Warp's own way (``module="unique"``) names it by its content, for which it goes through
    the kernel and all that it calls when it is defined, and once more when it is loaded.
    """
    with _state.defining:
        made = wp.kernel(function, module=wp.Module(_module_name(function)), enable_backward=False)
        KERNELS.append(made)
    return made


def _module_name(function: Callable[..., None]) -> str:
    """A name for a kernel's module that no other in this process has, and that it has in every process.

    Warp keeps compiled kernels by this name and their content. Kernels that are made by a function are told apart by
    their parameters and by what they take from it. Those that this cannot tell apart are numbered, and may be compiled
    again in a process that makes them in another order.
    """
    taken = [*function.__annotations__.values(), *(cell.cell_contents for cell in function.__closure__ or ())]
    words = [function.__module__, function.__qualname__, *(_in_a_word(value) for value in taken)]
    name = f"{function.__name__}_{hashlib.sha256(' '.join(words).encode()).hexdigest()[:8]}"
    count = _state.names[name] = _state.names.get(name, 0) + 1
    return name if count == 1 else f"{name}_{count}"


def _in_a_word(value: object) -> str:
    """What a kernel takes from the function that makes it, or the type of a parameter, the same in every process."""
    value = getattr(value, "dtype", value)  # of an array
    name = getattr(value, "key", getattr(value, "__qualname__", None))  # Warp's functions and structs have keys
    if name is None:
        name = value if isinstance(value, (bool, int, float, str)) else type(value).__qualname__
    return str(name)


def once(make: Make) -> Make:
    """A function that makes kernels, or what they are made of: once for equal arguments, whichever thread asks first.

    Two kernels of one name would share a module of Warp's, and the second would have the first's code unloaded.
    """
    cached = functools.cache(make)

    @functools.wraps(make)
    def made(*arguments: Hashable) -> object:
        with _state.defining:
            return cached(*arguments)

    return cast("Make", made)


def set_threads(threads: SupportsIndex | None = None) -> None:
    """Use this many CPU threads for the launches from now on; ``None`` means one for each core.

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
    """A line for the user if threads share launches in the slower way, as this Warp is not known; else None."""
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


def launch(kernel: wp.Kernel, count: int, arguments: Sequence[object], device: wp.Device) -> None:
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
        run = on_this_thread(record_launch(kernel, arguments, device))
    else:
        run = _team().prepare(kernel, arguments, device)
    reports = min(count, REPORTS) if progress.is_watched() else 1
    for k in range(reports):
        first, end = (count * part // reports for part in (k, k + 1))
        run(first, end - first)
        progress.report(end / count)


def launch_in_order(kernel: wp.Kernel, count: int, arguments: Sequence[object], device: wp.Device) -> None:
    """Run ``kernel(first, *arguments)`` for ``count`` items, on the CPU one after another on one thread.

    For kernels whose items share memory. CUDA runs them at once, so such kernels use atomics all the same (Warp's
    atomics are plain additions on the CPU). Raises as :func:`launch` does.
    """
    if count > 0:
        _check_count(count)
        kernel_cache.load(kernel, device)
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)


def _check_count(count: int) -> None:
    """Refuse a launch of more items than can be numbered, in an ``InputError``."""
    if count > MOST_ITEMS:
        raise InputError(
            f"{count} items at once, at most {MOST_ITEMS} can be numbered: take a smaller scene or resolution"
        )


def _team() -> ThreadTeam | PythonThreads:
    """The threads that share launches: one team for each number of threads, made at the first launch of that many."""
    threads = _state.threads
    team = _state.teams.get(threads)
    if team is None:
        with _state.lock:
            team = _state.teams.get(threads)
            if team is None:
                team = PythonThreads(threads) if why_not_native() else ThreadTeam(threads)
                _state.teams[threads] = team
    return team
