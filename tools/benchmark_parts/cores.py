"""The processor: its name, and how many of its cores are used."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

ALL = os.sched_getaffinity(0)
"""Cores that this process may use."""


@contextmanager
def one_core() -> Iterator[None]:
    """The whole process on one core, for what cannot be told its number of threads."""
    try:
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
