"""Times things in turn in one process (A B A B ...), so that whatever slows the machine slows all of them."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping
from typing import TypedDict


class Summary(TypedDict):
    """Milliseconds of one job over all its rounds."""

    median: float
    min: float
    max: float


def in_turn(
    jobs: Mapping[str, Callable[[], object]], rounds: int, most_seconds: float = math.inf
) -> dict[str, list[float]]:
    """Milliseconds of each job in each round: what its call took, or the seconds that the call returns if it gives a
    float.

    A first round is run that does not count. Every other round goes backwards, so that no job always comes after the
    same one. No round begins later than ``most_seconds`` after the first did; if none does, the first one counts.
    """
    spent: dict[str, list[float]] = {name: [] for name in jobs}
    begun = time.perf_counter()
    for turn in range(rounds + 1):
        if turn and time.perf_counter() - begun > most_seconds:
            break
        for name in reversed(list(jobs)) if turn % 2 else jobs:
            start = time.perf_counter()
            seconds = jobs[name]()
            if not isinstance(seconds, float):
                seconds = time.perf_counter() - start
            if turn == 1:
                spent[name].clear()
            spent[name].append(1000 * seconds)
    return spent


def summary(values: list[float]) -> Summary:
    """Median, fastest and slowest."""
    return {"median": statistics.median(values), "min": min(values), "max": max(values)}


def timed_in_turn(
    jobs: Mapping[str, Callable[[], object]], rounds: int, most_seconds: float = math.inf
) -> dict[str, Summary]:
    """The summary of each job's milliseconds."""
    return {name: summary(values) for name, values in in_turn(jobs, rounds, most_seconds).items()}
