"""Commands are found by scanning their folder; wrong input is one line, whichever command is given it."""

import importlib
from collections.abc import Callable
from pathlib import Path

import pytest
import typer

from ldtrefl.base import budget
from ldtrefl.cli import commands
from ldtrefl.cli.program import main
from tests.cli.conftest import Done
from tests.conftest import SMALL_SCENE

TOY = '''
import typer

from ldtrefl.cli.printing import say

PLACE_IN_HELP = 15
app = typer.Typer()


@app.command()
def greet(name: str) -> None:
    """Greet."""
    say(f"hello {name}")
'''


def test_the_help_lists_every_command_at_its_place(run: Callable[..., Done]) -> None:
    files = [path.stem for path in Path(commands.__file__).parent.glob("*.py") if path.stem != "__init__"]
    words = [line[2:].split() for line in run("--help").output.split("Commands")[1].splitlines()]
    listed = [each[0] for each in words if each and each[0] in files]
    places = [importlib.import_module(f"ldtrefl.cli.commands.{name}").PLACE_IN_HELP for name in listed]
    assert set(listed) == set(files) and places == sorted(set(places))
    assert [name for name in listed if name in ("render", "compare", "cache")] == ["render", "compare", "cache"]


def test_a_new_file_is_a_new_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    (tmp_path / "toy_command_of_a_test.py").write_text(TOY)
    monkeypatch.setattr(commands, "__path__", [*commands.__path__, str(tmp_path)])
    program = commands.all_commands.__wrapped__()
    assert isinstance(program, typer.Typer)
    monkeypatch.setattr("ldtrefl.cli.program._PROGRAM", program)
    assert main(["greet", "world"]) == 0 and capfd.readouterr().out == "hello world\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("render none.toml", "none.toml"),
        ("render bad.toml", "unknown key 'eyee'"),
        ("render scene.toml --method nope", "unknown method 'nope'"),
        ("render scene.toml --set resolution=-1", "resolution"),
        ("render scene.toml --set resolution", "OPTION=VALUE"),
        ("render scene.toml --set method=bvh", "unknown option of method ldt 'method'"),
        ("render scene.toml --set self=1", "unknown option of method ldt 'self'"),
        ("render scene.toml --set skip=regions,bonds", "did you mean 'bounds'"),
        ("render scene.toml --set skip=[1]", "expected all, none, or names"),
        ("render scene.toml --set error=0", "error: should be greater than 0"),
        ("render scene.toml --set cull=none", "'safe' or 'flat'"),
        ("render scene.toml -o none/a.png", "does not exist"),
        ("render scene.toml -o a.bmp", ".jpeg or .webp"),
        ("render scene.toml --threads 0", "threads"),
        ("render scene.toml --device cuda:77", "no device"),
        ("render scene.toml --memory much", "--memory"),
        ("render scene.toml --cache maps --no-cache", "exclude each other"),
        ("render", "SCENE"),
        ("rendr scene.toml", "rendr"),
        ("render scene.toml --fast", "--fast"),
        ("compare scene.toml --methods ldt,nope", "unknown method 'nope'"),
        ("compare scene.toml --set resolution=64", "METHOD.OPTION=VALUE"),
        ("compare scene.toml --set linear.resolution=64", "METHOD one of bvh, ldt, envmap"),
        ("peel none.ply", "none.ply"),
        ("info none.toml", "none.toml"),
        ("", "command"),
    ],
)
def test_wrong_input_is_one_line(run: Callable[..., Done], scene_folder: Path, arguments: str, message: str) -> None:
    (scene_folder / "bad.toml").write_text(SMALL_SCENE.replace("eye = ", "eyee = "))
    before = sorted(scene_folder.iterdir())
    done = run(*arguments.split())
    assert done.status == 2 and len(done.errors) == 1 and message in done.errors[0], done
    assert sorted(scene_folder.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "variable", "status", "message"),
    [
        ("info scene.toml --memory 100K", "", 2, "needs 78.5 KiB beside 94.5 KiB"),
        ("render scene.toml --memory much", "", 2, "--memory: expected a size"),
        ("compare scene.toml --memory 9K", "1G", 2, "allowed are 9.0 KiB"),
        ("peel torus --memory 9K", "", 2, "allowed are 9.0 KiB"),
        ("info torus", "9K", 2, "allowed are 9.0 KiB"),
        ("info scene.toml", "many", 2, "LDTREFL_MEMORY: expected a size"),
        ("info scene.toml --memory 1G", "9K", 0, "memory: about 173.0 KiB"),
    ],
)
def test_memory_that_is_allowed(
    run: Callable[..., Done], monkeypatch: pytest.MonkeyPatch, arguments: str, variable: str, status: int, message: str
) -> None:
    monkeypatch.setenv(budget.VARIABLE, variable)
    done = run(*arguments.split())
    assert done.status == status and message in (" ".join(done.errors) if status else done.output), done
    assert len(done.errors) == (1 if status else 0)
