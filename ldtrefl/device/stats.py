"""What a frame cost: stage timers and counters."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import warp as wp

from ldtrefl.device import progress


@dataclass
class Stats:
    """What a frame cost: seconds per stage, and counts of what was done and what was skipped."""

    seconds: dict[str, float] = field(default_factory=dict)
    counters: dict[str, int] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str, device: wp.Device) -> Iterator[None]:
        """Add the time of this block to ``seconds[name]``, the device's work included."""
        with progress.in_stage(name):
            start = time.perf_counter()
            try:
                yield
                if device.is_cuda:
                    wp.synchronize_device(device)
            finally:
                self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def count(self, name: str, amount: int) -> None:
        """Add ``amount`` to ``counters[name]``."""
        self.counters[name] = self.counters.get(name, 0) + int(amount)
