"""Options that commands share."""

from pathlib import Path

import pytest

from ldtrefl.base.errors import InputError
from ldtrefl.cli.options import mesh_or_shape, parsed_settings


def test_settings_are_values_of_toml_or_words() -> None:
    assert parsed_settings(["a=[1, 2]", "b=word", "c=1 2", " d = 0.5"]) == {
        "a": [1, 2],
        "b": "word",
        "c": "1 2",
        "d": 0.5,
    }
    assert parsed_settings(None) == {}


def test_settings_have_the_limits_of_a_scene_file() -> None:
    for value in ("[" * 3000, "1" * 4301, "{" + "a." * 5000 + "a=1}"):
        with pytest.raises(InputError, match="--set a: line 1: "):
            parsed_settings([f"a={value}"])


@pytest.mark.parametrize("setting", ["resolution", "=3", " = 3"])
def test_settings_need_a_name_and_a_value(setting: str) -> None:
    with pytest.raises(InputError, match="expected OPTION=VALUE"):
        parsed_settings([setting])


def test_a_file_hides_the_shape_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert len(mesh_or_shape("torus").faces) > 0
    (tmp_path / "torus").write_text("no mesh")
    with pytest.raises(InputError, match="torus"):
        mesh_or_shape("torus")
