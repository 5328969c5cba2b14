"""``ldtrefl render``: pictures and statistics."""

from collections.abc import Callable
from pathlib import Path

import pytest

import ldtrefl
from tests.cli.conftest import Done


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "scene.png: 24 x 16"),
        (("-o", "a.exr", "--method", "bvh", "--threads", "1"), "a.exr: 24 x 16"),
        (("-o", "a.png", "--set", "resolution=32", "--set", "search=linear", "--no-cache"), "march"),
        (("--stats", "--cache", "maps"), "pixels see a reflector"),
    ],
)
def test_it_renders(run: Callable[..., Done], scene_folder: Path, options: tuple[str, ...], said: str) -> None:
    done = run("render", "scene.toml", *options)
    assert done.status == 0 and said in done.output and not done.errors, done
    (picture,) = [path for path in scene_folder.iterdir() if path.suffix in (".png", ".exr")]
    assert ldtrefl.load_image(picture).shape == (16, 24, 3)


def test_stats_say_what_was_skipped(run: Callable[..., Done], scene_folder: Path) -> None:
    lines = run("render", "scene.toml", "--stats").output.splitlines()
    said = ["of 384 pixels see a reflector", "reflector triangles", "rays reflected", "not searched", "searches"]
    assert all(words in line for words, line in zip(said, lines[1:-1], strict=True))
    assert "1 objects peeled" in lines[-1]
    path = scene_folder / "scene.toml"
    path.write_text(path.read_text().replace("look_at = [0.0, 0.0, 0.0]", "look_at = [0.0, -9.0, 0.0]"))
    assert run("render", "scene.toml", "--stats").output.splitlines()[1:] == [
        "0 of 384 pixels see a reflector",
        "no reflector in view: nothing culled, peeled or traced",
    ]
