"""One thread or all of them, for everybody alike."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

ALL = os.sched_getaffinity(0)
"""Cores that this process may use."""


@contextmanager
def threads(count: int, tracers: Iterable[Any]) -> Iterator[None]:
    """So many threads for each tracer's ``set_threads``; for one, the whole process is kept to one core, since some
    (Embree's builds through embreex) cannot be told."""
    for tracer in tracers:
        tracer.set_threads(count)
    try:
        if count == 1:
            _keep_to({max(ALL)})
        yield
    finally:
        _keep_to(ALL)


def _keep_to(cores: set[int]) -> None:
    """Every thread that this process has: a new one starts where its maker is."""
    for task in Path("/proc/self/task").iterdir():
        with suppress(ProcessLookupError):
            os.sched_setaffinity(int(task.name), cores)


def processor() -> str:
    """The CPU's name as the kernel tells it, and how many cores of it there are."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    fields = dict(part.split(":", 1) for line in reversed(lines) if ":" in line for part in [line])
    named = {key.strip(): value.strip() for key, value in fields.items()}
    kinds = ("avx512f", "avx2", "avx", "sse4_2")
    vectors = next((kind for kind in kinds if kind in named.get("flags", "").split()), "no vectors")
    family = " ".join(f"{word} {named[word]}" for word in ("cpu family", "model", "stepping") if word in named)
    return f"{named.get('model name', 'unknown CPU')} ({family}, {vectors}), {len(ALL)} cores"
