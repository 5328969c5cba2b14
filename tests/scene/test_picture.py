"""The table ``[picture]`` of a scene file."""

from pathlib import Path

import pytest

import ldtrefl
from ldtrefl import Picture
from tests.conftest import SMALL_SCENE


def load(folder: Path, table: str) -> ldtrefl.Scene:
    (folder / "scene.toml").write_text(SMALL_SCENE + table)
    return ldtrefl.load_scene(folder / "scene.toml")


def test_a_picture_is_as_its_radiance_unless_the_scene_says_more(tmp_path: Path) -> None:
    assert load(tmp_path, "").picture == Picture() == Picture(exposure=0.0, tone_mapping="none")
    said = load(tmp_path, '\n[picture]\nexposure = 1\ntone_mapping = "aces"\n').picture
    assert said == Picture(exposure=1.0, tone_mapping="aces")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('tone_mapping = "filmic"', r"picture\.tone_mapping: should be 'none', 'agx' or 'aces', got 'filmic'"),
        ("exposure = 40.0", r"picture\.exposure: should be less than or equal to 32, got 40"),
        ("exposure = nan", r"picture\.exposure: should be a finite number, got nan"),
        ("gamma = 2.2", r"picture: unknown key 'gamma' \(allowed: exposure, tone_mapping\)"),
    ],
)
def test_what_is_not_allowed_is_one_line(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=rf"scene\.toml: {message}"):
        load(tmp_path, f"\n[picture]\n{line}\n")


def test_wrong_values_are_refused_in_python() -> None:
    with pytest.raises(ldtrefl.InputError, match=r"Picture: tone_mapping: should be 'none', 'agx' or 'aces'"):
        Picture(tone_mapping="filmic")
