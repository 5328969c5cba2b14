"""``ldtrefl cache``: an empty folder."""

from collections.abc import Callable
from pathlib import Path

from tests.cli.conftest import Done


def test_an_empty_cache(run: Callable[..., Done], scene_folder: Path) -> None:
    assert run("cache", "info", "--cache", "maps").output.startswith(f"{Path('maps')}: 0 files, 0.0 MB of at most")
    assert run("cache", "clear", "--cache", "maps").output == "maps: 0 files removed\n"
    assert (scene_folder / "maps").stat().st_mode & 0o777 == 0o700
