"""Threads that share a kernel's launch on the CPU, in native code.

A launch is one native call, and Python needs some 100 microseconds to have another thread make one and to learn that
it is done: as long as many launches take as a whole. So the slices of a launch are shared out by native code,
``cpu_threads.h``, which Warp compiles as the body of the kernel ``work_on_board``. The launching thread writes a *job*
on the team's *board* and works at it. Its helpers do, too: they go on looking at the board for a moment after each job
before they sleep. How a job goes over the board is drawn at the head of ``cpu_threads.h``.

The native code calls kernels as Warp does (``warp_abi.py``). Before the first such call ``thread_self_test.py`` tries
whether that works with this version of Warp. Where it does not, ``python_threads.py`` is used in place of this file.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import threading
import time
import weakref
from collections.abc import Sequence

import warp as wp

from ldtrefl.device import kernel_cache, warp_abi
from ldtrefl.device.native_sources import native_body
from ldtrefl.device.recorded_launch import RangeLaunch, on_this_thread, record_launch

SLICES_PER_THREAD = 64
"""Slices of a job for each thread. To take one costs 50 nanoseconds; the last ones make others wait."""

LOOKS_BEFORE_SLEEP = 5_000
"""Looks at a board with nothing to do before a thread sleeps: some 200 microseconds, longer than what Python does
between most launches. With four times as many, threads held up launches by a third more where another program used
their cores."""

POLL_SECONDS = 1e-5
"""Seconds that a launch sleeps at a time while helpers that the system holds up finish their slices."""

MOST_ARGUMENT_BYTES = 4096
"""Bytes of a kernel's arguments that fit on the board."""


class _Job(ctypes.Structure):
    """``Job`` of ``cpu_threads.h``: a launch over items from ``first`` on."""

    _fields_ = (
        ("kernel", ctypes.c_uint64),  # address of its code
        ("arguments", ctypes.c_uint64),  # address of its arguments, the first an int32
        ("argument_bytes", ctypes.c_uint64),
        ("first", ctypes.c_uint64),
        ("items", ctypes.c_uint64),
        ("slices", ctypes.c_uint64),
    )


class _Counter(ctypes.Structure):
    """``Counter`` of ``cpu_threads.h``: a number in a cache line of its own."""

    _fields_ = (("value", ctypes.c_uint64), ("unused", ctypes.c_uint64 * 7))


class _Board(ctypes.Structure):
    """``Board`` of ``cpu_threads.h``, what the threads of a team share. A ``_Counter`` for each thread follows it."""

    _fields_ = (
        ("job", _Job),
        ("arguments", ctypes.c_uint64 * (MOST_ARGUMENT_BYTES // 8)),
        ("threads", _Counter),
        ("finished", _Counter),  # slices
    )


CONSTANTS: dict[str, float | int] = {
    "BOARD_BYTES": ctypes.sizeof(_Board),
    "MOST_ARGUMENT_BYTES": MOST_ARGUMENT_BYTES,
}
FILES = ("device/cpu_threads.h",)
"""What the native function here is made of, after ``warp_abi.CALL_KERNEL``."""

WORK = "ThreadTeam::work(board_address, job_address, thread, most_looks);"


@wp.func_native(warp_abi.CALL_KERNEL + native_body(CONSTANTS, FILES, WORK))
def work(board_address: wp.uint64, job_address: wp.uint64, thread: wp.uint64, most_looks: wp.uint64):
    """``ThreadTeam::work`` of ``cpu_threads.h``."""


@wp.kernel(module="unique", enable_backward=False)
def work_on_board(board_address: wp.uint64, job_address: wp.uint64, thread: wp.uint64, most_looks: wp.uint64):
    """The one item of a launch works at a board's jobs as one thread of the team."""
    work(board_address, job_address, thread, most_looks)


class ThreadTeam:
    """A thread that launches, and its helpers. Where several threads launch at once, one of them has the helpers."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._memory = (ctypes.c_char * (ctypes.sizeof(_Board) + threads * ctypes.sizeof(_Counter)))()
        self._board = _Board.from_buffer(self._memory)
        self._board.threads.value = threads
        self._job = _Job()
        self._launching = threading.Lock()
        self._calls: dict[wp.Kernel, warp_abi.NativeCall] = {}
        self._workers = [self._worker(thread) for thread in range(threads)]
        self._wake_ups = [threading.Event() for _ in range(threads - 1)]
        self._has_ended = False
        self._helpers: list[threading.Thread] = []
        for k in range(threads - 1):
            helper = threading.Thread(target=self._help, args=(k,), daemon=True)
            try:
                helper.start()
            except RuntimeError:
                break  # The system gives no more threads: the others take the slices of those that are missing.
            self._helpers.append(helper)
        _teams.add(self)
        atexit.register(self.end)

    def _worker(self, thread: int) -> wp.Launch:
        """A launch of ``work_on_board`` for one thread of the team; thread 0 is the one that brings jobs."""
        cpu = wp.get_device("cpu")
        kernel_cache.load(work_on_board, cpu)
        job = 0 if thread else ctypes.addressof(self._job)
        inputs = [ctypes.addressof(self._board), job, thread, LOOKS_BEFORE_SLEEP]
        return wp.launch(work_on_board, dim=1, inputs=inputs, device=cpu, record_cmd=True)

    def prepare(self, kernel: wp.Kernel, arguments: Sequence[object], cpu: wp.Device) -> RangeLaunch:
        """Make ``kernel(first, *arguments)`` ready to be run by the team for ranges of items."""
        command = record_launch(kernel, arguments, cpu)
        call = self._calls.get(kernel)
        if call is None or not call.is_for(command):
            call = self._calls[kernel] = warp_abi.NativeCall(command)
        run_alone = on_this_thread(command)
        # What does not fit on the board, or cannot be called with an item's number, one thread runs.
        if call.argument_bytes > MOST_ARGUMENT_BYTES or not call.is_possible:
            return run_alone

        def run(first: int, items: int) -> None:
            slices = min(items, SLICES_PER_THREAD * self._threads)
            if slices == 1 or self._has_ended or not self._launching.acquire(blocking=False):
                run_alone(first, items)
                return
            try:
                self._run_job(call, call.arguments(command), first, items, slices)
            finally:
                self._launching.release()

        return run

    def _run_job(
        self, call: warp_abi.NativeCall, arguments: ctypes.Structure, first: int, items: int, slices: int
    ) -> None:
        """Wake the helpers, put a job on the board, and work at it until all of its slices are finished."""
        job = self._job
        job.kernel = call.entry_point
        job.arguments, job.argument_bytes = ctypes.addressof(arguments), call.argument_bytes
        job.first, job.items, job.slices = first, items, slices
        for wake_up in self._wake_ups:
            wake_up.set()
        # Whatever happens, the arguments must live till the helpers have done with them.
        self._board.finished.value = slices  # till the job is on the board
        try:
            self._workers[0].launch()
        finally:
            self._wait_for(slices)

    def _wait_for(self, slices: int) -> None:
        """Wait till all slices are finished, however often the user presses Ctrl-C meanwhile."""
        interrupt = None
        while self._board.finished.value < slices:
            try:
                time.sleep(POLL_SECONDS)
            except KeyboardInterrupt as error:
                interrupt = error
        if interrupt is not None:
            raise interrupt

    def _help(self, helper: int) -> None:
        """What a helper's thread does: sleep until it is woken, then work at the board's jobs."""
        wake_up, worker = self._wake_ups[helper], self._workers[1 + helper]
        while not self._has_ended:
            wake_up.wait()
            wake_up.clear()
            worker.launch()

    def end(self) -> None:
        """Have the helpers leave native code, as they must before Warp unloads it. Later launches have none."""
        self._has_ended = True
        with self._launching:  # a thread that lives on may be launching
            for wake_up in self._wake_ups:
                wake_up.set()
        for helper in self._helpers:
            helper.join()
        atexit.unregister(self.end)


_teams: weakref.WeakSet[ThreadTeam] = weakref.WeakSet()


def _after_fork_in_child() -> None:
    # The helpers do not exist here: nobody can wake them or wait for them.
    for team in list(_teams):
        atexit.unregister(team.end)
    _teams.clear()


os.register_at_fork(after_in_child=_after_fork_in_child)
