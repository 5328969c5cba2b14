"""Options that belong together: each field of a dataclass is an option, and the command gets the dataclass."""

from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from ldtrefl.cli.option_groups import grouped


@dataclass(frozen=True)
class Place:
    name: Annotated[str, typer.Argument(metavar="PLACE")]
    height: Annotated[float, typer.Option("--height", help="Metres.")] = 1.5


@dataclass(frozen=True)
class Light:
    bright: Annotated[bool, typer.Option("--bright")] = False


def said(*words: str) -> tuple[int, str]:
    """Exit status and output of a command with two groups and an option of its own."""
    app = typer.Typer()

    @app.command()
    @grouped
    def command(place: Place, count: Annotated[int, typer.Option("--count")] = 2, *, light: Light) -> None:
        """Say what was given."""
        print(place, count, light)

    done = CliRunner().invoke(app, list(words))
    return done.exit_code, done.output


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["here"], "Place(name='here', height=1.5) 2 Light(bright=False)\n"),
        (
            ["--bright", "--count", "7", "there", "--height", "-2"],
            "Place(name='there', height=-2.0) 7 Light(bright=True)\n",
        ),
    ],
    ids=str,
)
def test_fields_are_options(words: list[str], expected: str) -> None:
    assert said(*words) == (0, expected)


def test_help_and_faults_are_those_of_any_option() -> None:
    status, text = said("--help")
    assert status == 0 and "PLACE" in text and "Metres." in text and "Say what was given." in text
    assert said()[0] == 2 and said("here", "--height", "high")[0] == 2
