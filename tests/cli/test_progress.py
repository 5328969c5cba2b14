"""A progress bar is shown on a terminal, after a while, and nowhere else."""

import io
import time

import pytest

from ldtrefl.cli import progress
from ldtrefl.cli.progress import progress_bar
from ldtrefl.device.progress import in_stage, is_watched


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def some_work() -> None:
    with in_stage("peel"):
        assert is_watched()
    time.sleep(0.3)


@pytest.mark.parametrize(("after", "is_shown"), [(0.0, True), (60.0, False)])
def test_on_a_terminal(monkeypatch: pytest.MonkeyPatch, after: float, is_shown: bool) -> None:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr(progress, "SHOWN_AFTER", after)
    with progress_bar():
        some_work()
    assert ("peel" in terminal.getvalue()) == is_shown
    assert not is_watched()


def test_elsewhere_nothing_is_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", io.StringIO())
    with progress_bar():
        assert not is_watched()
