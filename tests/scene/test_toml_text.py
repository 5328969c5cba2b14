"""Scene files as text: what is beyond the limits is refused in one line, before Python's reader sees it."""

import os
import tomllib
from pathlib import Path

import pytest

from ldtrefl import InputError
from ldtrefl.scene.toml_text import MAX_BRACKETS, MAX_BYTES, MAX_DOTS, MAX_WORD, parse_toml, read_toml

BEYOND = [
    (f"a = {'[' * (MAX_BRACKETS + 1)}", "brackets"),
    (f"a = {'[' * MAX_BRACKETS}[1, 2.5]{']' * MAX_BRACKETS}", "brackets"),
    ("a = [[1, 2e3], [" + "1.1" * 4301, "more than 16 dots"),
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
    i = {"[" * (MAX_BRACKETS - 1)}[1, -2.5, +3.25e-07]{"]" * (MAX_BRACKETS - 1)}
    j = [1, 2, [3, 4], "[5, 6"]
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
