"""What the tests of commands share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from ldtrefl.cli.program import main
from tests.conftest import SMALL_SCENE


@dataclass(frozen=True)
class Done:
    """What a command left behind."""

    status: int
    output: str
    errors: list[str]
    """Lines on standard error, but for the one about kernels being compiled."""


@pytest.fixture
def scene_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, which holds ``scene.toml``."""
    (tmp_path / "scene.toml").write_text(SMALL_SCENE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(scene_folder: Path, capfd: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Runs the command line in this process, in the folder of ``scene.toml``."""
    assert scene_folder.is_dir()

    def run_here(*arguments: object) -> Done:
        capfd.readouterr()
        status = main([str(argument) for argument in arguments])
        said = capfd.readouterr()
        errors = [line for line in said.err.splitlines() if not line.startswith("ldtrefl: compiling kernels")]
        return Done(status, said.out, errors)

    return run_here
