"""Stats: times and counts of one name add up, of a block that raises, too."""

import pytest

from ldtrefl.device import launch
from ldtrefl.device.stats import Stats


def test_counts_of_one_name_add_up() -> None:
    stats = Stats()
    for amount in (1, 0, 41):
        stats.count("rays", amount)
    stats.count("steps", 7)
    assert stats.counters == {"rays": 42, "steps": 7}


def test_times_of_one_name_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([10.0, 12.5, 20.0, 21.0])
    monkeypatch.setattr("ldtrefl.device.stats.time.perf_counter", lambda: next(clock))
    stats, device = Stats(), launch.resolve_device(None)
    with stats.stage("march", device):
        pass
    with pytest.raises(ValueError), stats.stage("march", device):
        raise ValueError
    assert stats.seconds == {"march": 3.5}
