"""The program as a shell sees it: what is on its streams, and its exit status."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ldtrefl.base.errors import InputError, printable
from ldtrefl.device.kernel_cache import NOTICE
from tests.conftest import SMALL_SCENE

NAME = "chair [/old] [red] :smile: \\u001b[31m\\n"
PROGRAM = f"{sys.executable} -m ldtrefl"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a scene whose names look like markup and terminal codes."""
    named = SMALL_SCENE.replace('"thing"', f'"{NAME}"').replace("[object.material]", "[object.material]\nalbedo = 0.5")
    (tmp_path / "scene [bold].toml").write_text(named.replace("[[object]]", '[[object]]\nname = "[b]"', 1))
    (tmp_path / "scene.toml").write_text(SMALL_SCENE)
    return tmp_path


def shell(command: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, **environment},
        check=False,
        timeout=120,
    )


def said(done: subprocess.CompletedProcess[str]) -> list[str]:
    """The lines on the error stream, but for the one that kernels are compiled."""
    return [line for line in done.stderr.splitlines() if not line.startswith(f"ldtrefl: {NOTICE[:17]}")]


def test_names_are_printed_as_they_are(folder: Path) -> None:
    done = shell(f"{PROGRAM} info 'scene [bold].toml'", folder)
    assert done.returncode == 0
    assert "chair [/old] [red] :smile: \\x1b[31m\\n" in done.stdout and " [b] " in done.stdout
    assert done.stderr == (
        "ldtrefl: object '[b]': material.albedo and material.mirror add up to 1.4 in red: "
        "above 1 it gives back more light than falls on it\n"
    )
    done = shell(f"{PROGRAM} render 'scene [bold].toml'", folder)
    assert done.stdout.startswith("scene [bold].png: 24 x 16") and len(said(done)) == 1


def test_names_that_the_encoding_does_not_have(folder: Path) -> None:
    os.rename(folder / "scene.toml", os.fsencode(folder) + b"/\xff\xc3\xa9.toml")
    for command in ("info", "render -o a.png"):
        done = shell(
            f"{PROGRAM} {command} *$'\\xa9'.toml", folder, PYTHONUTF8="0", LC_ALL="C", PYTHONIOENCODING="ascii"
        )
        assert done.returncode == 0 and said(done) == [], done.stderr


def test_messages_hold_nothing_that_a_terminal_obeys() -> None:
    assert str(InputError("a\x1b[2J\u202e\nb \udcff é")) == "a\\x1b[2J\\u202e b \\udcff é"
    assert printable("plain [x] é") == "plain [x] é"


@pytest.mark.parametrize(
    ("command", "status", "lines"),
    [
        ("info scene.toml >&-", 0, 0),
        ("render scene.toml -o a.png >&- 2>&- <&-", 0, 0),
        ("render none.toml 2>&-", 2, 0),
        ("render none.toml 2>/dev/full", 2, 0),
        ("info scene.toml >/dev/full", 1, 1),
        ("methods >/dev/full", 1, 1),
        ("--help >/dev/full", 1, 1),
        ("render scene.toml >/dev/full", 1, 1),
        ("cache info --cache . >/dev/full", 1, 1),
        ("info scene.toml | true", 0, 0),
        ("methods | head -1", 0, 0),
        ("peel torus --resolution 16 | true", 0, 0),
    ],
)
def test_streams_that_are_closed_or_full(folder: Path, command: str, status: int, lines: int) -> None:
    done = shell(f"{PROGRAM} {command}", folder)
    assert done.returncode == status, done.stderr
    assert len(done.stderr.splitlines()) == lines and "Traceback" not in done.stderr
    if lines:
        assert "standard output: No space left on device" in done.stderr
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("name", ["pipe.toml", "pipe.ply", "/dev/zero", "/tmp"])
def test_what_is_no_regular_file(folder: Path, name: str) -> None:
    for pipe in ("pipe.toml", "pipe.ply"):
        os.mkfifo(folder / pipe)
    for command in ("info", "render"):
        done = shell(f"timeout 20 {PROGRAM} {command} {name}", folder)
        assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr
        assert "regular file" in done.stderr
