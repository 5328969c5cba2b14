"""Threads that share a kernel's launch on the CPU.

A launch is one native call, and Python needs some 100 microseconds to have another thread make one and to learn that
it is done: as long as many launches take as a whole. So the slices of a launch are shared out by native code, which
Warp compiles as the body of a kernel, ``work_at``. The launching thread writes a *job* on the crew's *board* and works
at it. The helpers do, too: they go on looking at the board for a moment after each job before they sleep.

Each thread has its own run of a job's slices, the same in every launch, and takes others' when those are done: what one
kernel wrote, the next then mostly reads in the same core's cache.
"""

from __future__ import annotations

import atexit
import ctypes
import threading
import time

import warp as wp

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


WORK = """
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
                wp::launch_bounds_t<1> bounds = {{(uint32_t)items}, (size_t)items, 1};
                *(int*)arguments = (int)(job.first + begin);
                ((void (*)(void*, void*))job.kernel)(&bounds, arguments);
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


@wp.func_native(WORK)
def work(board_address: wp.uint64, job_address: wp.uint64, thread: wp.uint64, patience: wp.uint64):
    """Take slices of the jobs on a board; first put a job there, and return when it is done, if there is one."""


@wp.kernel(module="unique", enable_backward=False)
def work_at(board_address: wp.uint64, job_address: wp.uint64, thread: wp.uint64, patience: wp.uint64):
    work(board_address, job_address, thread, patience)


class Crew:
    """A thread that launches, and its helpers. Where several launch at once, one has the helpers."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._room = (ctypes.c_char * (ctypes.sizeof(_Board) + threads * ctypes.sizeof(_Number)))()
        self._board = _Board.from_buffer(self._room)
        self._board.threads.value = threads
        self._job = _Job()
        self._is_free = threading.Lock()
        self._blocks: dict[wp.Kernel, type[ctypes.Structure]] = {}
        self._work = [self._work_of(thread) for thread in range(threads)] if threads > 1 else []
        self._wake = [threading.Event() for _ in range(threads - 1)]
        self._is_over = False
        self._helpers = [threading.Thread(target=self._help, args=(k,), daemon=True) for k in range(threads - 1)]
        for helper in self._helpers:
            helper.start()
        atexit.register(self._end)

    def _work_of(self, thread: int) -> wp.Launch:
        command = wp.Launch(work_at, wp.get_device("cpu"))
        job = 0 if thread else ctypes.addressof(self._job)
        for k, value in enumerate((ctypes.addressof(self._board), job, thread, PATIENCE)):
            command.set_param_at_index(k, value)
        command.set_dim(1)
        return command

    def launch(self, command: wp.Launch, first: int, items: int) -> None:
        """Run a recorded kernel, whose first parameter is the first item's number, for items from ``first`` on."""
        slices = min(items, SLICES * self._threads)
        if self._threads == 1 or slices == 1 or not self._is_free.acquire(blocking=False):
            command.set_param_at_index(0, first)
            command.set_dim(items)
            command.launch()
            return
        try:
            self._share(command, first, items, slices)
        finally:
            self._is_free.release()

    def _share(self, command: wp.Launch, first: int, items: int, slices: int) -> None:
        arguments = self._packed(command)
        job = self._job
        job.kernel = ctypes.cast(command.hooks.forward, ctypes.c_void_p).value
        job.arguments, job.argument_bytes = ctypes.addressof(arguments), ctypes.sizeof(arguments)
        job.first, job.items, job.slices = first, items, slices
        for wake in self._wake:
            wake.set()
        # Whatever happens, the arguments must live till the helpers have done with them.
        self._board.finished.value = slices  # till the job is on the board
        try:
            self._work[0].launch()
        finally:
            while self._board.finished.value < slices:
                time.sleep(LOOK_AGAIN)

    def _packed(self, command: wp.Launch) -> ctypes.Structure:
        """The arguments as the kernel's entry point reads them: one after another as in a C structure."""
        arguments = command.params[1:]
        if command.kernel not in self._blocks:
            fields = [(f"argument_{k}", type(argument)) for k, argument in enumerate(arguments)]
            fields.append(("end", ctypes.c_uint64 * 0))  # a whole number of words
            self._blocks[command.kernel] = type("Block", (ctypes.Structure,), {"_fields_": fields})
        block = self._blocks[command.kernel](*arguments)
        assert ctypes.sizeof(block) <= LARGEST_ARGUMENTS
        return block

    def _help(self, helper: int) -> None:
        wake, work = self._wake[helper], self._work[1 + helper]
        while not self._is_over:
            wake.wait()
            wake.clear()
            work.launch()

    def _end(self) -> None:
        """Have the helpers leave native code before Warp unloads it."""
        self._is_over = True
        for wake in self._wake:
            wake.set()
        for helper in self._helpers:
            helper.join()
