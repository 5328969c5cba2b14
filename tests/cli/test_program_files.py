"""The command line on a small scene: what it refuses, in one line, and what it writes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import ldtrefl
from ldtrefl import InputError
from ldtrefl.base import budget
from tests.conftest import SMALL_SCENE


def run(*arguments: object, folder: Path) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "ldtrefl", *map(str, arguments)]
    return subprocess.run(command, check=False, capture_output=True, text=True, cwd=folder, timeout=120)


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE)
    return path


def test_command_line_refuses_in_one_line(scene_file: Path) -> None:
    folder = scene_file.parent
    (folder / "bad.toml").write_text(SMALL_SCENE.replace("eye = ", "eyee = "))
    before = sorted(path.name for path in folder.iterdir())
    for arguments, message in [
        (("render", "none.toml"), "none.toml"),
        (("render", "bad.toml"), "unknown key 'eyee'"),
        (("render", "scene.toml", "--method", "nope"), "unknown method 'nope'"),
        (("render", "scene.toml", "--set", "resolution=-1"), "resolution"),
        (("render", "scene.toml", "--set", "resolution"), "OPTION=VALUE"),
        (("render", "scene.toml", "--set", "skip=regions,bonds"), "did you mean 'bounds'"),
        (("render", "scene.toml", "--set", "skip=[1]"), "expected all, none, or names"),
        (("render", "scene.toml", "--set", "error=0"), "error: should be greater than 0"),
        (("render", "scene.toml", "--set", "cull=none"), "'safe' or 'flat'"),
        (("render", "scene.toml", "-o", "none/a.png"), "does not exist"),
        (("render", "scene.toml", "-o", "a.bmp"), ".png or .exr"),
        (("render", "scene.toml", "--threads", "0"), "threads"),
        (("render", "scene.toml", "--device", "cuda:77"), "no device"),
        (("render",), "SCENE"),
        (("rendr", "scene.toml"), "rendr"),
        (("render", "scene.toml", "--fast"), "--fast"),
        (("compare", "scene.toml", "--methods", "ldt,nope"), "unknown method 'nope'"),
        (("compare", "scene.toml", "--set", "resolution=64"), "METHOD.OPTION=VALUE"),
        (("peel", "none.ply"), "none.ply"),
        (("info", "none.toml"), "none.toml"),
        ((), "command"),
    ]:
        done = run(*arguments, folder=folder)
        lines = done.stderr.strip().splitlines()
        assert done.returncode == 2, (arguments, done.stderr)
        assert len(lines) == 1 and message in lines[0], (arguments, done.stderr)
    assert sorted(path.name for path in folder.iterdir()) == before


def test_command_line_does_its_work(scene_file: Path) -> None:
    folder = scene_file.parent
    for arguments, said in [
        (("render", "scene.toml"), "scene.png: 24 x 16"),
        (("render", "scene.toml", "-o", "a.exr", "--method", "bvh", "--threads", "1"), "a.exr"),
        (("render", "scene.toml", "-o", "b.png", "--set", "resolution=32", "--set", "search=linear"), "march"),
        (("compare", "scene.toml", "-o", "cmp", "--set", "ldt.resolution=64"), "envmap"),
        (("peel", "genus3", "-o", "layers.png", "--resolution", "64"), "layers per face"),
        (("info", "scene.toml"), "torus"),
        (("info", "genus3"), "closed"),
        (("methods",), "quality = 'balanced'  Of the exact search"),
    ]:
        done = run(*arguments, folder=folder)
        assert done.returncode == 0 and said in done.stdout, (arguments, done.stdout, done.stderr)
        assert not [line for line in done.stderr.splitlines() if not line.startswith("ldtrefl: compiling kernels")]
    assert ldtrefl.load_image(folder / "scene.png").shape == (16, 24, 3)
    made = {path.name for path in (folder / "cmp").iterdir()}
    pictures = {f"{name}{kind}.png" for name in ("ldt", "envmap") for kind in ("", "-difference")} | {"bvh.png"}
    assert made == pictures | {"compare.json"}


def test_set_on_the_command_line_has_the_same_limits() -> None:
    from ldtrefl.cli.commands import _options  # noqa: PLC0415

    assert _options(["a=[1, 2]", "b=word", "c=1 2"]) == {"a": [1, 2], "b": "word", "c": "1 2"}
    for value in ("[" * 3000, "1" * 4301, "{" + "a." * 5000 + "a=1}"):
        with pytest.raises(InputError, match="--set a: line 1: "):
            _options([f"a={value}"])


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
