"""Options that commands share."""

from pathlib import Path

import pytest

from ldtrefl.base.errors import InputError
from ldtrefl.cli.options import SceneWanted, mesh_or_shape, parsed_settings, parsed_size
from tests.conftest import SMALL_SCENE


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


def test_a_size_is_width_and_height() -> None:
    assert parsed_size("640x480") == (640, 480) == parsed_size("640X480") and parsed_size(None) is None


@pytest.mark.parametrize("size", ["640", "x480", "640x", "-1x4", "6.5x4", "640x480x3", "640 x 480", "1" * 5000 + "x1"])
def test_another_way_to_write_a_size_is_refused(size: str) -> None:
    with pytest.raises(InputError, match="expected WIDTHxHEIGHT, such as 768x512"):
        parsed_size(size)


def test_a_scene_file_takes_a_size_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SMALL_SCENE)
    camera = SceneWanted(path, size="10x20").loaded().camera
    assert (camera.width, camera.height, camera.eye) == (10, 20, (0.0, -5.0, 1.0))
    for options in ({"on": "studio"}, {"up": "y"}, {"mirror": "self"}):
        with pytest.raises(InputError, match=r"scene\.toml: '\w+' goes with a mesh file, this is a scene file"):
            SceneWanted(path, **options).loaded()
    with pytest.raises(InputError, match=r"size: should be width and height, .* got \(99999, 2\)"):
        SceneWanted(path, size="99999x2").loaded()


def test_only_the_mesh_itself_can_be_made_a_mirror(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--mirror all: only 'self' is allowed"):
        SceneWanted(tmp_path / "a.ply", mirror="all").loaded()
