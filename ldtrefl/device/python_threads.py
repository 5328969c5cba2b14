"""Python threads that share a kernel's launch on the CPU, by Warp's public functions alone.

That is slower than ``cpu_threads.py``, which depends on how Warp calls kernels, and it gives the same bits. Warp lets
other Python threads run while a kernel does.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import warp as wp

from ldtrefl.device import kernel_cache
from ldtrefl.device.recorded_launch import RangeLaunch

SLICES_PER_THREAD = 4
"""Slices of a launch for each thread. Each costs 100 microseconds."""


class _SlicedLaunch:
    """The slices of one launch, each run once by the thread that takes it."""

    def __init__(self, run_slice: Callable[[int, int], None], bounds: Sequence[int]) -> None:
        """Slice k is ``run_slice(bounds[k], bounds[k + 1])``."""
        self._run_slice = run_slice
        self._lock = threading.Lock()
        self._slices = itertools.pairwise(bounds)
        self._unfinished = len(bounds) - 1
        self._all_finished = threading.Event()
        self._error: BaseException | None = None

    def work(self) -> None:
        """Run slices till none is left to be taken."""
        while True:
            with self._lock:
                bounds = next(self._slices, None)
            if bounds is None:
                return
            try:
                self._run_slice(*bounds)
            except BaseException as error:
                self._error = error
            with self._lock:
                self._unfinished -= 1
                if not self._unfinished:
                    self._all_finished.set()

    def wait(self) -> None:
        """Wait till no thread is at work any more, then raise what was raised."""
        while not self._all_finished.is_set():
            try:
                self._all_finished.wait()
            except KeyboardInterrupt as error:
                self._error = error
        if self._error is not None:
            raise self._error


class PythonThreads:
    """Threads that help whoever launches; several threads may launch at once."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._helpers = ThreadPoolExecutor(max(1, threads - 1), thread_name_prefix="ldtrefl")

    def prepare(self, kernel: wp.Kernel, arguments: Sequence[object], cpu: wp.Device) -> RangeLaunch:
        """Make ``kernel(first, *arguments)`` ready to be run by the threads for ranges of items."""
        kernel_cache.load(kernel, cpu)

        def run_slice(begin: int, end: int) -> None:
            inputs = [begin, *arguments]
            wp.launch(kernel, dim=end - begin, inputs=inputs, device=cpu, record_tape=False)

        def run(first: int, items: int) -> None:
            slices = min(items, SLICES_PER_THREAD * self._threads)
            sliced = _SlicedLaunch(run_slice, [first + items * k // slices for k in range(slices + 1)])
            for _ in range(min(slices, self._threads) - 1):
                try:
                    self._helpers.submit(sliced.work)
                except RuntimeError:
                    break  # The system gives no more threads, or the program ends.
            sliced.work()
            sliced.wait()

        return run
