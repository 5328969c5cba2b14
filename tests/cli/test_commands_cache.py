"""The cache of maps from the command line: used, told about, cleared, left out."""

from pathlib import Path

import pytest

from ldtrefl.cli.commands import main
from tests.conftest import SMALL_SCENE

SCENE = SMALL_SCENE.replace("segments = [16, 8] }\ntranslate", "segments = [150, 50] }\ntranslate")
"""The torus has 15,000 triangles: enough to be kept."""


def test_maps_are_kept_told_about_and_cleared(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, folder = tmp_path / "scene.toml", str(tmp_path / "kept")
    scene.write_text(SCENE)
    command = ["render", str(scene), "-o", str(tmp_path / "a.png"), "--stats"]
    assert main([*command, "--no-cache"]) == 0
    assert main([*command, "--cache", folder]) == 0
    assert "1 objects peeled" in capfd.readouterr().out
    assert main([*command, "--cache", folder]) == 0
    assert "1 from the cache" in capfd.readouterr().out
    assert main(["cache", "info", "--cache", folder]) == 0
    assert "1 files" in capfd.readouterr().out
    assert main(["cache", "clear", "--cache", folder]) == 0
    assert main([*command, "--cache", folder, "--no-cache"]) == 2
    assert main([*command, "--cache", str(scene)]) == 2
    assert "\n" not in capfd.readouterr().err.strip().splitlines()[-1]
