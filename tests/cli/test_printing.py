"""What commands print is printed as it is."""

import pytest
from rich.table import Table
from rich.text import Text

from ldtrefl.cli.printing import ReaderGone, say, stage_times
from ldtrefl.device.stats import Stats
from ldtrefl.frame.result import Frame


def test_names_that_look_like_markup(capfd: pytest.CaptureFixture[str]) -> None:
    say("[bold]x[/bold] :smile: \x1b[2J", "1.5")
    assert capfd.readouterr().out == "[bold]x[/bold] :smile: \\x1b[2J 1.5\n"


def test_long_lines_are_not_broken(capfd: pytest.CaptureFixture[str]) -> None:
    say("word " * 100)
    say(Text("word " * 100))
    assert capfd.readouterr().out.count("\n") == 2


def test_tables_fit_into_a_pipe(capfd: pytest.CaptureFixture[str]) -> None:
    table = Table("a", "b")
    table.add_row("word " * 100, "1")
    say(table)
    lines = capfd.readouterr().out.splitlines()
    assert len(lines) > 4 and max(map(len, lines)) <= 200


def test_a_reader_that_has_gone_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    class Gone:
        encoding = "utf-8"

        def isatty(self) -> bool:
            return False

        def write(self, _: str) -> None:
            raise BrokenPipeError

        def flush(self) -> None:
            raise BrokenPipeError

    monkeypatch.setattr("sys.stdout", Gone())
    with pytest.raises(ReaderGone):
        say("a")


def test_stage_times() -> None:
    frame = Frame(None, Stats({"gbuffer": 0.0125, "march": 2.0}), None)  # type: ignore[arg-type]
    assert stage_times(frame) == "gbuffer 0.013, march 2.000" or stage_times(frame) == "gbuffer 0.012, march 2.000"
