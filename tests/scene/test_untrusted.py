"""Files that nobody has looked at: small inputs that ask for much are refused in one line, soon, with little memory."""

import gc
import os
import subprocess
import sys
import tomllib
import weakref
from collections.abc import Iterator
from pathlib import Path

import pytest

import ldtrefl
from ldtrefl import InputError
from ldtrefl.base import budget
from ldtrefl.scene import shapes
from ldtrefl.scene.toml_text import MAX_BRACKETS, MAX_BYTES, MAX_DOTS, MAX_WORD, parse_toml, read_toml
from tests.conftest import SMALL_SCENE


@pytest.fixture(autouse=True)
def default_limit(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Every test starts with the default limit."""
    monkeypatch.delenv(budget.VARIABLE, raising=False)
    budget.set_memory_limit(None)
    yield
    budget.set_memory_limit(None)


BEYOND = [
    (f"a = {'[' * (MAX_BRACKETS + 1)}", "brackets"),
    ("a = " + "[" * 3000, "line 1: more than 32 brackets"),
    ("\n\na = " + "{ a = " * 3000, "line 3: more than 32 brackets"),
    ("a." * 50_000 + "a = 1", "more than 16 dots"),
    ("[" + "a." * 50_000 + "a]", "more than 16 dots"),
    (" . ".join(['"a"'] * 50_000) + " = 1", "more than 16 dots"),
    (" . ".join(["'a'"] * 50_000) + " = 1", "more than 16 dots"),
    ("a = { " + "a." * 50_000 + "a = 1 }", "more than 16 dots"),
    ("a = " + "1" * 4301, "more than 100 characters"),
    ("a = 1." + "1" * 4301, "more than 100 characters"),
    ("a = 0x" + "f" * 4301, "more than 100 characters"),
    ('a = """ \' """"" # " \n b = ' + "[" * 3000, "line 2: more than 32 brackets"),
    ("a = ''' \" ''''' # ' \n b = " + "[" * 3000, "line 2: more than 32 brackets"),
    ('a = "\\" # " # "\n b = ' + "[" * 3000, "line 2: more than 32 brackets"),
    ("a = '\\' # '\n b = " + "[" * 3000, "line 2: more than 32 brackets"),
]


@pytest.mark.parametrize(("text", "message"), BEYOND, ids=[text[:20] for text, _ in BEYOND])
def test_text_beyond_the_limits(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_toml(text)


def test_text_within_the_limits_is_what_pythons_reader_says() -> None:
    brackets, dots = "[" * 3000, "." * 3000
    text = f"""
    a = '{brackets}' # {brackets}{dots}
    b = "{dots}\\"{brackets}"
    c = \"\"\"{brackets}
        ""{dots}\\\"\"\"{brackets}\"\"\"\"\"
    d = '''{brackets}''{dots}
        {brackets}'''''
    e = {"[" * MAX_BRACKETS}{"]" * MAX_BRACKETS}
    f = {{ {"a." * MAX_DOTS}a = {"1" * MAX_WORD} }}
    g = [1.5, -2.5e-3, 1979-05-27T07:32:00.999999-07:00, "]", ']', "", '']
    {"h" * MAX_WORD} = 0x1
    [x . "y.z" . 'w']
    """
    assert parse_toml(text) == tomllib.loads(text)


@pytest.mark.parametrize(
    "text", ['a = "', 'a = """ [[', "a = '", "a = ''' [[", "a = [", "a = 1\x00", "a = ]]]]", "= 1"]
)
def test_what_is_no_toml_is_said_to_be_none(text: str) -> None:
    with pytest.raises(InputError, match="not TOML"):
        parse_toml(text)


def test_only_regular_files_of_moderate_size(tmp_path: Path) -> None:
    pipe, large = tmp_path / "pipe.toml", tmp_path / "large.toml"
    os.mkfifo(pipe)
    with large.open("wb") as file:
        file.truncate(1 << 40)
    for path, message in [
        (pipe, "must be a regular file, this is a pipe"),
        (Path("/dev/zero"), "this is a device"),
        (tmp_path, "this is a folder"),
        (large, f"has {1 << 40} bytes, at most {MAX_BYTES} allowed"),
        (tmp_path / "none.toml", "No such file"),
        (tmp_path / "a\0b.toml", "no file name"),
    ]:
        with pytest.raises(InputError, match=message):
            read_toml(path)


def test_set_on_the_command_line_has_the_same_limits() -> None:
    from ldtrefl.cli.commands import _options  # noqa: PLC0415

    assert _options(["a=[1, 2]", "b=word", "c=1 2"]) == {"a": [1, 2], "b": "word", "c": "1 2"}
    for value in ("[" * 3000, "1" * 4301, "{" + "a." * 5000 + "a=1}"):
        with pytest.raises(InputError, match="--set a: line 1: "):
            _options([f"a={value}"])


def test_a_scene_adds_up_and_counts_what_is_shared_once(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE)
    with budget.account() as one:
        first = ldtrefl.load_scene(path)
    with budget.account() as again:  # nothing is made now: the shapes are still in use
        ldtrefl.load_scene(path)
    twice = SMALL_SCENE + SMALL_SCENE[SMALL_SCENE.index("[[object]]") :]
    path.write_text(twice)
    with budget.account() as two:
        second = ldtrefl.load_scene(path)
    assert one.taken == again.taken == two.taken > 0
    assert second.objects[0].geometry is second.objects[2].geometry is first.objects[0].geometry
    budget.set_memory_limit(one.taken)
    ldtrefl.load_scene(path)
    budget.set_memory_limit(one.taken - 1)
    with pytest.raises(InputError, match=r"object\[1\]\.shape: .* for the rest of the scene, allowed are"):
        ldtrefl.load_scene(path)


def test_a_shape_goes_when_nobody_uses_it() -> None:
    mesh = weakref.ref(shapes.make("torus_knot", {"segments": [50, 7]}))
    gc.collect()
    assert mesh() is None


def test_memory_on_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SMALL_SCENE)
    for words, variable, status, message in [
        (["info", "scene.toml", "--memory", "100K"], "", 2, "needs 78.5 KiB beside 78.5 KiB"),
        (["render", "scene.toml", "--memory", "much"], "", 2, "--memory: expected a size"),
        (["compare", "scene.toml", "--memory", "9K"], "1G", 2, "allowed are 9.0 KiB"),
        (["peel", "torus", "--memory", "9K"], "", 2, "allowed are 9.0 KiB"),
        (["info", "torus"], "9K", 2, "allowed are 9.0 KiB"),
        (["info", "scene.toml"], "many", 2, "LDTREFL_MEMORY: expected a size"),
        (["info", "scene.toml", "--memory", "1G"], "9K", 0, "memory: about 157.0 KiB"),
    ]:
        environment = {**os.environ, budget.VARIABLE: variable}
        command = [sys.executable, "-m", "ldtrefl", *words]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
        said = done.stderr if status else done.stdout
        assert done.returncode == status and message in said, (words, done)
        assert len(done.stderr.splitlines()) == (1 if status else 0)
