"""Python threads that share a kernel's launch on the CPU, by Warp's public functions alone.

That is slower than ``crew.py``, which depends on how Warp calls kernels, and it gives the same bits. Warp lets other
Python threads run while a kernel does.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import warp as wp

from ldtrefl.device import kernel_cache

POOL_SLICES = 4
"""Slices of a launch for each thread. Each costs 100 microseconds."""

Run = Callable[[int, int], None]
"""A kernel that is ready to be run for some items: the first one's number, and how many."""


class _Slices:
    """The slices of one launch, each run once by whoever takes it."""

    def __init__(self, run_slice: Callable[[int, int], None], bounds: Sequence[int]) -> None:
        self._run_slice = run_slice
        self._lock = threading.Lock()
        self._to_do = itertools.pairwise(bounds)
        self._unfinished = len(bounds) - 1
        self._are_finished = threading.Event()
        self._error: BaseException | None = None

    def work(self) -> None:
        """Run slices till none is left to be taken."""
        while True:
            with self._lock:
                taken = next(self._to_do, None)
            if taken is None:
                return
            try:
                self._run_slice(*taken)
            except BaseException as error:
                self._error = error
            with self._lock:
                self._unfinished -= 1
                if not self._unfinished:
                    self._are_finished.set()

    def finish(self) -> None:
        """Wait till no thread is at work any more, then raise what was raised."""
        while not self._are_finished.is_set():
            try:
                self._are_finished.wait()
            except KeyboardInterrupt as error:
                self._error = error
        if self._error is not None:
            raise self._error


class Pool:
    """Threads that help whoever launches; several may launch at once."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._helpers = ThreadPoolExecutor(max(1, threads - 1), thread_name_prefix="ldtrefl")

    def prepared(self, kernel: wp.Kernel, count: int, arguments: Sequence[Any], cpu: wp.Device) -> Run:
        """``kernel(first, *arguments)``, ready to be run by the threads for some of ``count`` items."""
        kernel_cache.load(kernel, cpu)

        def run_slice(begin: int, end: int) -> None:
            inputs = [begin, *arguments]
            wp.launch(kernel, dim=end - begin, inputs=inputs, device=cpu, record_tape=False)

        def run(first: int, items: int) -> None:
            count = min(items, POOL_SLICES * self._threads)
            slices = _Slices(run_slice, [first + items * k // count for k in range(count + 1)])
            for _ in range(min(count, self._threads) - 1):
                try:
                    self._helpers.submit(slices.work)
                except RuntimeError:
                    break  # The system gives no more threads, or the program ends.
            slices.work()
            slices.finish()

        return run
