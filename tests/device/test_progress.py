"""Progress: launches of a thread are reported to whoever asks in that thread, with the stage that they belong to."""

import threading

import pytest

from ldtrefl.device import launch
from ldtrefl.device.progress import in_stage, is_watched, progress_to, report
from ldtrefl.device.stats import Stats
from tests.device.launches import assert_all_launched


def test_progress_reaches_the_end() -> None:
    seen: list[float] = []
    with progress_to(lambda stage, fraction: seen.append(fraction)):
        assert_all_launched(1000, 1)
    assert len(seen) > 1 and seen == sorted(seen) and seen[-1] == 1.0


def test_progress_is_of_the_thread_that_asks() -> None:
    seen: list[float] = []
    with progress_to(lambda stage, fraction: seen.append(fraction)):
        other = threading.Thread(target=assert_all_launched, args=(1000, 1))
        other.start()
        other.join()
    assert not seen


def test_stages_stand_in_one_another() -> None:
    seen: list[tuple[str, float]] = []
    report(0.5)
    with progress_to(lambda stage, fraction: seen.append((stage, fraction))), in_stage("outer"):
        with Stats().stage("inner", launch.resolve_device(None)):
            report(0.5)
        report(1.0)
    assert seen == [("outer", 0.0), ("inner", 0.0), ("inner", 0.5), ("outer", 1.0)]
    assert not is_watched()


def test_an_observer_that_raises_leaves_no_trace() -> None:
    def interrupt(stage: str, fraction: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), progress_to(interrupt), in_stage("stopped"):
        pass
    assert not is_watched()
    seen = []
    with progress_to(lambda stage, fraction: seen.append(stage)):
        report(1.0)
    assert seen == [""]
