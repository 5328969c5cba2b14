"""Kernels that will be needed are compiled on other CPU threads before they are launched.

Whoever knows which kernels are to come says so (:func:`foresee`). Nothing happens if they are in Warp's cache. When a
first kernel had to be compiled (:func:`begin`), helpers compile those that were foreseen, in that order, into the same
cache. A launch waits for a kernel that a helper has begun, and compiles others meanwhile (:func:`wait_for`).

Only kernels of the CPU are built ahead. Warp's compiler runs without Python's lock; what it needs of Python runs under
a lock of Warp's own.
"""

from __future__ import annotations

import atexit
import os
import threading
from collections.abc import Iterable

import warp as wp

from ldtrefl.device import warp_abi

MOST_HELPERS = 7
"""Threads that compile at most: a render needs some thirty kernels, and the longest takes a fifth of all the time."""


class _State:
    """What the process has foreseen and begun. ``changed`` guards it."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.known: set[wp.Kernel] = set()
        self.waiting: dict[wp.Kernel, None] = {}  # in the order in which they were foreseen
        self.underway: set[wp.Kernel] = set()
        self.helpers = 0  # that are running
        self.most_helpers = 0
        self.compiler: int | None = None  # the thread that compiled the first kernel; None before that
        self.is_paused = False  # while the process forks, and at its end


_state = _State()


def foresee(kernels: Iterable[wp.Kernel], threads: int) -> None:
    """Say which kernels the CPU will need, those that take longest first, and how many threads may compile them.

    They come before what was foreseen earlier: whoever knows more of a scene names what takes longer.
    """
    with _state.changed:
        new = [kernel for kernel in kernels if kernel not in _state.known]
        _state.known.update(new)
        _state.waiting = dict.fromkeys(new) | _state.waiting
        _state.most_helpers = min(threads - 1, MOST_HELPERS)
    _start_helpers()


def begin() -> None:
    """This thread has compiled a kernel that was not in the cache: those foreseen are not there either."""
    with _state.changed:
        if _state.compiler is None:
            _state.compiler = threading.get_ident()
    _start_helpers()


def stop() -> None:
    """Begin no more: the cache cannot be used."""
    with _state.changed:
        _state.waiting.clear()
        _state.most_helpers = 0


def wait_for(kernel: wp.Kernel) -> None:
    """Leave a kernel to the caller, or wait till a helper that has begun it is done, and compile others meanwhile."""
    while True:
        with _state.changed:
            _state.waiting.pop(kernel, None)
            if kernel not in _state.underway:
                return
        if not _build_next():
            with _state.changed:
                _state.changed.wait_for(lambda: kernel not in _state.underway)


def _start_helpers() -> None:
    """Start as many helpers as there is work for, once the first kernel has been compiled."""
    with _state.changed:
        if _state.compiler is None or _state.is_paused:
            return
        for _ in range(min(_state.most_helpers - _state.helpers, len(_state.waiting))):
            try:
                threading.Thread(target=_help, name="ldtrefl-compiler", daemon=True).start()
            except RuntimeError:
                return  # The system gives no more threads: kernels are compiled when they are launched.
            _state.helpers += 1


def _help() -> None:
    """What a helper does: compile till nothing is waiting."""
    try:
        with warp_abi.headers_of_thread(_state.compiler):
            while _build_next():
                pass
    finally:
        with _state.changed:
            _state.helpers -= 1


def _build_next() -> bool:
    """Compile the first kernel that is waiting; whether there was one."""
    with _state.changed:
        if _state.is_paused or not _state.waiting:
            return False
        kernel = next(iter(_state.waiting))
        del _state.waiting[kernel]
        _state.underway.add(kernel)
    try:
        warp_abi.compile_for_cpu(kernel)
    finally:
        with _state.changed:
            _state.underway.discard(kernel)
            _state.changed.notify_all()
    return True


def _pause() -> None:
    """Wait till no helper is compiling: a forked process would find its locks held, an ending one its code gone."""
    with _state.changed:
        _state.is_paused = True
        _state.changed.wait_for(lambda: not _state.underway)


def _after_fork_in_parent() -> None:
    with _state.changed:
        _state.is_paused = False
    _start_helpers()


def _after_fork_in_child() -> None:
    # The helpers do not exist here, and whoever held the condition does not either.
    _state.__init__()  # type: ignore[misc]


os.register_at_fork(before=_pause, after_in_parent=_after_fork_in_parent, after_in_child=_after_fork_in_child)
atexit.register(_pause)
