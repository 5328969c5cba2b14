"""``ldtrefl peel``: counts and a picture."""

from collections.abc import Callable
from pathlib import Path

import ldtrefl
from tests.cli.conftest import Done


def test_it_counts_and_draws_layers(run: Callable[..., Done], scene_folder: Path) -> None:
    done = run("peel", "genus3", "-o", "layers.png", "--resolution", "64")
    assert done.status == 0 and not done.errors, done
    lines = done.output.splitlines()
    assert [line.split(":")[0].split(",")[0] for line in lines] == [
        "genus3",
        "layers per face",
        "crossings per axis",
        "fragments",
        "layers drawn to layers.png",
    ]
    assert ldtrefl.load_image(scene_folder / "layers.png").shape[2] == 3
