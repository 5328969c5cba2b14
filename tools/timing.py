"""Timing things in turn in one process (A B A B ...)."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any


def in_turn(jobs: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, list[float]]:
    """Milliseconds of each job in each round: what it took, or the seconds that it returns itself.

    One round first does not count. Every other round goes backwards, so that no job always comes after the same one.
    """
    spent: dict[str, list[float]] = {name: [] for name in jobs}
    for turn in range(rounds + 1):
        for name in reversed(list(jobs)) if turn % 2 else jobs:
            start = time.perf_counter()
            seconds = jobs[name]()
            if not isinstance(seconds, float):
                seconds = time.perf_counter() - start
            if turn:
                spent[name].append(1000 * seconds)
    return spent


def summary(values: list[float]) -> dict[str, float]:
    """Median, fastest and slowest."""
    return {"median": statistics.median(values), "min": min(values), "max": max(values)}


def timed_in_turn(jobs: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, dict[str, float]]:
    """The summary of each job's milliseconds."""
    return {name: summary(values) for name, values in in_turn(jobs, rounds).items()}
