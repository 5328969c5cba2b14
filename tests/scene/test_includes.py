"""``[[include]]``: a glTF file's nodes, lights and camera in a scene file."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import Camera
from ldtrefl.scene.includes import up_axis
from tests.scene.gltf.writer import Written

CAMERA = "[camera]\neye = [0, -5, 1]\nlook_at = [0, 0, 0]\n"


def room(folder: Path) -> Path:
    """A file with a sheet, a light and a camera."""
    file = Written(
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
        cameras=[{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
    )
    file.quad(material=0)
    file.tree["materials"] = [{"name": "paint"}]
    file.tree["nodes"][0] |= {"name": "sheet", "translation": [0, 2, 0]}
    file.add("nodes", {"extensions": {"KHR_lights_punctual": {"light": 0}}})
    file.add("nodes", {"camera": 0, "translation": [0, 0, 9]})
    return file.save(folder, "room.glb")


def loaded(folder: Path, text: str) -> ldtrefl.Scene:
    """A scene file beside the room."""
    room(folder)
    (folder / "scene.toml").write_text(text)
    return ldtrefl.load_scene(folder / "scene.toml")


def test_nodes_and_lights_are_added_behind_the_scene_s_own(tmp_path: Path) -> None:
    light = '[[light]]\nkind = "directional"\ndirection = [0, 0, -1]\nradiance = 1.0\n'
    ball = '[[object]]\nname = "ball"\nshape = "sphere"\n'
    scene = loaded(tmp_path, CAMERA + light + ball + '[[include]]\nfile = "room.glb"\n')
    assert [entry.name for entry in scene.objects] == ["ball", "sheet"]
    assert [light.kind for light in scene.lights] == ["directional", "point"]
    np.testing.assert_allclose(scene.objects[1].world_from_object()[:3, 3], [0, 0, 2], atol=1e-12)


def test_a_scene_without_a_camera_takes_the_file_s(tmp_path: Path) -> None:
    scene = loaded(tmp_path, '[[include]]\nfile = "room.glb"\nlights = false\ntranslate = [1, 0, 0]\n')
    np.testing.assert_allclose(scene.camera.eye, [1, -9, 0], atol=1e-12)
    assert scene.lights == ()
    np.testing.assert_allclose(scene.objects[0].world_from_object()[:3, 3], [1, 0, 2], atol=1e-12)


def test_a_scene_whose_up_is_y_leaves_the_file_as_it_is(tmp_path: Path) -> None:
    scene = loaded(tmp_path, CAMERA + 'up = [0, 1, 0]\n[[include]]\nfile = "room.glb"\n')
    np.testing.assert_allclose(scene.objects[0].world_from_object()[:3, 3], [0, 2, 0], atol=1e-12)


def test_the_axis_of_a_camera_s_up() -> None:
    for up, name in (((0, 0, 2), "z"), ((0, -1, 0), "-y"), ((1, 0, 0), "x"), ((0, 1, 1), "z")):
        assert up_axis(Camera(eye=(3, 3, 3), look_at=(0, 0, 0), up=up)) == name
    assert up_axis(None) == "z"


@pytest.mark.parametrize(("table", "match"), [
    ('fil = "room.glb"', r"scene\.toml: include\[0\]: unknown key 'fil'; did you mean 'file'"),
    ('file = "none.glb"', r"^[^:]*scene\.toml: include\[0\]\.file: no file 'none\.glb'"),
    ('file = "scene.toml"', r"include\[0\].*not|include\[0\].*needed"),
    ('file = "room.glb"\nscale = 0', r"include\[0\]\.scale"),
    ('file = "room.glb"\nrotate = [0, 0, 0, 1]', "the axis must not be the zero vector"),
])  # fmt: skip
def test_what_is_wrong_is_named(tmp_path: Path, table: str, match: str) -> None:
    with pytest.raises(InputError, match=match):
        loaded(tmp_path, CAMERA + f"[[include]]\n{table}\n")


def test_what_is_said_of_nodes_and_materials_counts(tmp_path: Path) -> None:
    table = 'file = "room.glb"\nparts = { "she?t" = { mirror = 0.5 }, "paint" = { albedo = 0.25 } }'
    scene = loaded(tmp_path, CAMERA + f"[[include]]\n{table}\n")
    (sheet,) = scene.objects
    assert sheet.material.mirror == (0.5, 0.5, 0.5)
    assert not sheet.is_reflector, "all of it is of the material 'paint'"
    assert sheet.material_of("paint").albedo == (0.25, 0.25, 0.25)
    assert sheet.material_of("other") is sheet.material


def test_a_name_of_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"include\[0\]: parts\.paper: unknown node or material 'paper'.*sheet"):
        loaded(tmp_path, CAMERA + '[[include]]\nfile = "room.glb"\nparts = { paper = { mirror = 0.5 } }\n')
