"""Threads that share a kernel's launch on the CPU.

A launch is one native call, and Python needs some 100 microseconds to have another thread make one and to learn that
it is done: as long as many launches take as a whole. So the slices of a launch are shared out by native code, which
Warp compiles as the body of a kernel, ``work_at``. The launching thread writes a *job* on the crew's *board* and works
at it. The helpers do, too: they go on looking at the board for a moment after each job before they sleep.

Each thread has its own run of a job's slices, the same in every launch, and takes others' when those are done: what one
kernel wrote, the next then mostly reads in the same core's cache.

That calls kernels as Warp does (``warp_abi.py``). Before the first such call ``why_not_native`` tries it; where it does
not work, Python threads launch the slices by Warp's public functions (``python_pool.py``).
"""

from __future__ import annotations

import atexit
import ctypes
import os
import threading
import time
import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.device import kernel_cache, warp_abi
from ldtrefl.device.python_pool import Run

SLICES = 64
"""Slices of a job for each thread. To take one costs 50 nanoseconds; the last ones make others wait."""

PATIENCE = 5_000
"""Looks at a board with nothing to do before a thread sleeps: some 200 microseconds, longer than what Python does
between most launches. With four times as many, threads held up launches by a third more where another program used
their cores."""

LOOK_AGAIN = 1e-5
"""Seconds that a launch sleeps at a time while helpers that the system holds up finish their slices."""

LARGEST_ARGUMENTS = 4096
"""Bytes of a kernel's arguments that fit on the board, as in ``WORK``."""


class _Job(ctypes.Structure):
    """A launch over items from ``first`` on."""

    _fields_ = (
        ("kernel", ctypes.c_uint64),  # its entry point, and its arguments, the first an int32
        ("arguments", ctypes.c_uint64),
        ("argument_bytes", ctypes.c_uint64),
        ("first", ctypes.c_uint64),
        ("items", ctypes.c_uint64),
        ("slices", ctypes.c_uint64),
    )


class _Number(ctypes.Structure):
    """A number in a cache line of its own."""

    _fields_ = (("value", ctypes.c_uint64), ("rest", ctypes.c_uint64 * 7))


class _Board(ctypes.Structure):
    """What the threads of a crew share; after it one more ``_Number`` for each: the job << 32 | slices taken."""

    _fields_ = (
        ("job", _Job),
        ("arguments", ctypes.c_uint64 * (LARGEST_ARGUMENTS // 8)),
        ("threads", _Number),
        ("finished", _Number),  # slices
    )


WORK = (
    warp_abi.CALL_KERNEL
    + """
    struct Job { uint64_t kernel, arguments, argument_bytes, first, items, slices; };
    struct Number { uint64_t value, rest[7]; };
    struct Board { Job job; uint64_t arguments[4096 / 8]; Number threads, finished, turns[1]; };
    const uint64_t CLOSED = 0xffffffff;  // in place of the slices taken
    Board& board = *(Board*)board_address;
    const uint64_t threads = board.threads.value;

    if (job_address) {
        // Close the board, write the job on it, open it.
        const Job& job = *(const Job*)job_address;
        const uint64_t number = board.turns[0].value >> 32;
        for (uint64_t t = 0; t < threads; ++t)
            __atomic_store_n(&board.turns[t].value, number << 32 | CLOSED, __ATOMIC_RELAXED);
        __atomic_thread_fence(__ATOMIC_SEQ_CST);
        board.job = job;
        for (uint64_t i = 0; 8 * i < job.argument_bytes; ++i)
            board.arguments[i] = ((const uint64_t*)job.arguments)[i];
        board.finished.value = 0;
        for (uint64_t t = 0; t < threads; ++t)
            __atomic_store_n(&board.turns[t].value, (number + 1) << 32, __ATOMIC_RELEASE);
    }

    Job job = {};
    alignas(16) uint64_t arguments[4096 / 8];
    uint64_t known = CLOSED;  // number of the job that these are
    for (uint64_t looks = 0; looks < patience; ++looks) {
        for (uint64_t k = 0; k < threads; ++k) {
            const uint64_t owner = (thread + k) % threads;
            uint64_t* place = &board.turns[owner].value;
            uint64_t turn = __atomic_load_n(place, __ATOMIC_ACQUIRE);
            while ((turn & CLOSED) != CLOSED) {
                if (turn >> 32 != known) {
                    // Copy the job, and make sure that it was not replaced meanwhile.
                    job = board.job;
                    for (uint64_t i = 0; i < 4096 / 8 && 8 * i < job.argument_bytes; ++i)
                        arguments[i] = board.arguments[i];
                    __atomic_thread_fence(__ATOMIC_SEQ_CST);
                    const uint64_t now = __atomic_load_n(place, __ATOMIC_RELAXED);
                    if (now >> 32 != turn >> 32 || (now & CLOSED) == CLOSED)
                        break;
                    known = turn >> 32;
                }
                const uint64_t slice = owner * job.slices / threads + (turn & CLOSED);
                if (slice >= (owner + 1) * job.slices / threads)
                    break;
                if (!__atomic_compare_exchange_n(place, &turn, turn + 1, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE))
                    continue;
                const uint64_t begin = slice * job.items / job.slices;
                const uint64_t items = (slice + 1) * job.items / job.slices - begin;
                *(int*)arguments = (int)(job.first + begin);
                Warp::call_kernel(job.kernel, items, arguments);
                __atomic_fetch_add(&board.finished.value, 1, __ATOMIC_RELEASE);
                looks = 0;
                turn = __atomic_load_n(place, __ATOMIC_ACQUIRE);
            }
        }
        if (job_address && __atomic_load_n(&board.finished.value, __ATOMIC_ACQUIRE) == board.job.slices)
            return;
#if defined(__x86_64__)
        __builtin_ia32_pause();
#endif
    }
"""
)


@wp.func_native(WORK)
def work(board_address: wp.uint64, job_address: wp.uint64, thread: wp.uint64, patience: wp.uint64):
    """Take slices of the jobs on a board; first put a job there, and return when it is done, if there is one."""


@wp.kernel(module="unique", enable_backward=False)
def work_at(board_address: wp.uint64, job_address: wp.uint64, thread: wp.uint64, patience: wp.uint64):
    work(board_address, job_address, thread, patience)


def recorded(kernel: wp.Kernel, count: int, arguments: Sequence[Any], cpu: wp.Device) -> wp.Launch:
    """A launch of ``kernel(first, *arguments)`` on the CPU that has not been made yet."""
    kernel_cache.load(kernel, cpu)
    return wp.launch(kernel, dim=count, inputs=[0, *arguments], device=cpu, record_cmd=True)


def alone(command: wp.Launch) -> Run:
    """Run a recorded launch on the thread that asks for it."""

    def run(first: int, items: int) -> None:
        command.set_param_at_index(0, first)
        command.set_dim(items)
        command.launch()

    return run


class Crew:
    """A thread that launches, and its helpers. Where several launch at once, one has the helpers."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._room = (ctypes.c_char * (ctypes.sizeof(_Board) + threads * ctypes.sizeof(_Number)))()
        self._board = _Board.from_buffer(self._room)
        self._board.threads.value = threads
        self._job = _Job()
        self._is_free = threading.Lock()
        self._calls: dict[wp.Kernel, warp_abi.NativeCall] = {}
        self._work = [self._work_of(thread) for thread in range(threads)]
        self._wake = [threading.Event() for _ in range(threads - 1)]
        self._is_over = False
        self._helpers: list[threading.Thread] = []
        for k in range(threads - 1):
            helper = threading.Thread(target=self._help, args=(k,), daemon=True)
            try:
                helper.start()
            except RuntimeError:
                break  # The system gives no more threads: the others take the slices of those that are missing.
            self._helpers.append(helper)
        _crews.add(self)
        atexit.register(self.end)

    def _work_of(self, thread: int) -> wp.Launch:
        cpu = wp.get_device("cpu")
        kernel_cache.load(work_at, cpu)
        job = 0 if thread else ctypes.addressof(self._job)
        inputs = [ctypes.addressof(self._board), job, thread, PATIENCE]
        return wp.launch(work_at, dim=1, inputs=inputs, device=cpu, record_cmd=True)

    def prepared(self, kernel: wp.Kernel, count: int, arguments: Sequence[Any], cpu: wp.Device) -> Run:
        """``kernel(first, *arguments)``, ready to be run by the threads for some of ``count`` items."""
        command = recorded(kernel, count, arguments, cpu)
        call = self._calls.get(kernel)
        if call is None or not call.is_for(command):
            call = self._calls[kernel] = warp_abi.NativeCall(command)
        run_alone = alone(command)
        # What does not fit on the board, or cannot be called with an item's number, one thread runs.
        if call.argument_bytes > LARGEST_ARGUMENTS or not call.is_possible:
            return run_alone

        def run(first: int, items: int) -> None:
            slices = min(items, SLICES * self._threads)
            if slices == 1 or self._is_over or not self._is_free.acquire(blocking=False):
                run_alone(first, items)
                return
            try:
                self._share(call, call.arguments(command), first, items, slices)
            finally:
                self._is_free.release()

        return run

    def _share(
        self, call: warp_abi.NativeCall, arguments: ctypes.Structure, first: int, items: int, slices: int
    ) -> None:
        job = self._job
        job.kernel = call.entry_point
        job.arguments, job.argument_bytes = ctypes.addressof(arguments), call.argument_bytes
        job.first, job.items, job.slices = first, items, slices
        for wake in self._wake:
            wake.set()
        # Whatever happens, the arguments must live till the helpers have done with them.
        self._board.finished.value = slices  # till the job is on the board
        try:
            self._work[0].launch()
        finally:
            self._wait_for(slices)

    def _wait_for(self, slices: int) -> None:
        """Wait till all slices are finished, however often the user presses Ctrl-C meanwhile."""
        stopped = None
        while self._board.finished.value < slices:
            try:
                time.sleep(LOOK_AGAIN)
            except KeyboardInterrupt as error:
                stopped = error
        if stopped is not None:
            raise stopped

    def _help(self, helper: int) -> None:
        wake, work = self._wake[helper], self._work[1 + helper]
        while not self._is_over:
            wake.wait()
            wake.clear()
            work.launch()

    def end(self) -> None:
        """Have the helpers leave native code, as they must before Warp unloads it. Later launches have none."""
        self._is_over = True
        with self._is_free:  # a thread that lives on may be launching
            for wake in self._wake:
                wake.set()
        for helper in self._helpers:
            helper.join()
        atexit.unregister(self.end)


_crews: weakref.WeakSet[Crew] = weakref.WeakSet()


def _after_fork_in_child() -> None:
    # The helpers do not exist here: nobody can wake them or wait for them.
    for crew in list(_crews):
        atexit.unregister(crew.end)
    _crews.clear()
    _tried.lock = threading.Lock()


os.register_at_fork(after_in_child=_after_fork_in_child)


TRIED_ITEMS = 1000
"""Items of the kernel that is tried: some for each slice of two threads, and not as many for each."""


@wp.struct
class Tried:
    """An argument with a member of each kind, of different sizes."""

    flag: wp.uint8
    offset: wp.float64
    scale: wp.vec3
    values: wp.array(dtype=float)


@wp.kernel(module="unique", enable_backward=False)
def tried_kernel(first: int, tried: Tried, values_out: wp.array(dtype=float)):
    i = first + wp.tid()
    added = tried.scale[0] + tried.scale[1] * tried.scale[2] + float(tried.offset) + float(tried.flag)
    values_out[i] = values_out[i] + tried.values[i] + added


def why_not_native() -> str | None:
    """Why slices cannot be shared in native code with this Warp; None if they can. Tried once in a process.

    A small kernel is called natively for several ranges of items and compared with Warp's own launch: every item must
    have been done once, and none beyond.
    """
    with _tried.lock:
        if not _tried.is_known:
            try:
                _tried.fault = _try()
            except Exception as error:
                _tried.fault = f"{type(error).__name__}: {' '.join(str(error).split())}"
            _tried.is_known = True
        return _tried.fault


class _Trial:
    """What has been found out, once in a process."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.is_known = False
        self.fault: str | None = None


_tried = _Trial()


def _try() -> str | None:
    tried = Tried()
    tried.flag, tried.offset, tried.scale = wp.uint8(3), wp.float64(0.5), wp.vec3(1.0, 2.0, 4.0)
    cpu = wp.get_device("cpu")
    tried.values = wp.array(np.arange(TRIED_ITEMS, dtype=np.float32), dtype=float, device=cpu)
    expected, found = (wp.zeros(TRIED_ITEMS, dtype=float, device=cpu) for _ in range(2))
    command = recorded(tried_kernel, TRIED_ITEMS, [tried, found], cpu)
    unknown = warp_abi.unknown_layout(command, kernel_cache.folders())
    if unknown is not None:
        return unknown
    crew = Crew(2)
    try:
        run = crew.prepared(tried_kernel, TRIED_ITEMS, [tried, found], cpu)
        for first, items in ((0, TRIED_ITEMS - 1), (1, 2 * SLICES), (TRIED_ITEMS // 2, 5)):
            run(first, items)
            inputs = [first, tried, expected]
            wp.launch(tried_kernel, dim=items, inputs=inputs, device=cpu, record_tape=False)
    finally:
        crew.end()
    same = np.array_equal(expected.numpy(), found.numpy())
    return None if same else "a kernel that was tried gave other values than Warp's own launch"
