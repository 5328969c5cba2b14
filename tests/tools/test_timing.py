"""Timing in turn: which rounds count, and in which order jobs come; never a time."""

import pytest
from timing import in_turn, summary, timed_in_turn


def test_rounds_end_with_the_time_allowed() -> None:
    """One round counts in any case, the first if there is no other; if there is one, the first does not count."""
    calls: list[float] = []
    slow = {"slow": lambda: calls.append(1.0) or 0.5}
    assert in_turn(slow, 5, most_seconds=0.0) == {"slow": [500.0]} and len(calls) == 1
    assert in_turn(slow, 3) == {"slow": [500.0] * 3} and len(calls) == 1 + 4


def test_every_other_round_goes_backwards() -> None:
    calls: list[str] = []
    in_turn({name: lambda name=name: calls.append(name) for name in "ab"}, 2)
    assert "".join(calls) == "ab" + "ba" + "ab"


def test_a_summary_is_the_median_between_fastest_and_slowest() -> None:
    assert summary([3.0, 1.0, 2.0]) == {"median": 2.0, "min": 1.0, "max": 3.0}
    assert timed_in_turn({"job": lambda: 0.002}, 3)["job"]["median"] == pytest.approx(2.0)
