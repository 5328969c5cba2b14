"""``ldtrefl cache``: maps are used, told about, cleared and left out."""

from collections.abc import Callable
from pathlib import Path

from tests.cli.conftest import Done
from tests.conftest import SMALL_SCENE

SCENE = SMALL_SCENE.replace("segments = [16, 8] }\ntranslate", "segments = [150, 50] }\ntranslate")
"""The torus has 15,000 triangles: enough to be kept."""


def test_an_empty_cache(run: Callable[..., Done], scene_folder: Path) -> None:
    assert run("cache", "info", "--cache", "maps").output.startswith(f"{Path('maps')}: 0 files, 0.0 MB of at most")
    assert run("cache", "clear", "--cache", "maps").output == "maps: 0 files removed\n"
    assert (scene_folder / "maps").stat().st_mode & 0o777 == 0o700


def test_maps_are_kept_told_about_and_cleared(run: Callable[..., Done], scene_folder: Path) -> None:
    (scene_folder / "scene.toml").write_text(SCENE)
    command = ("render", "scene.toml", "--stats")
    assert "1 objects peeled" in run(*command, "--no-cache").output
    assert "1 objects peeled" in run(*command, "--cache", "kept").output
    assert "1 from the cache" in run(*command, "--cache", "kept").output
    assert "1 files" in run("cache", "info", "--cache", "kept").output
    assert run("cache", "clear", "--cache", "kept").output == "kept: 1 files removed\n"
    assert run(*command, "--cache", "kept", "--no-cache").status == 2
    refused = run(*command, "--cache", "scene.toml")
    assert refused.status == 2 and len(refused.errors) == 1
