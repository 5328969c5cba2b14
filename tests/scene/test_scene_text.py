"""A scene written as a scene file makes the same picture."""

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl import Environment, Light, Material, Mesh, Object, Picture, Reflection, Scene
from ldtrefl.scene.composed import composed
from ldtrefl.scene.mesh_scene import include_of, mesh_scene
from ldtrefl.scene.scene_text import check_scene_writable, save_scene, scene_text
from ldtrefl.scene.stages import STAGES
from tests.scene.gltf.writer import Written

OBJ = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def on_disk(folder: Path, name: str = "corner.obj") -> str:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(OBJ)
    return str(folder / name)


@pytest.mark.parametrize("on", [None, *STAGES])
def test_what_is_written_is_read_as_the_same(tmp_path: Path, on: str | None) -> None:
    """Every value to the last bit, and so the picture's too."""
    mesh = on_disk(tmp_path / "meshes")
    scene = composed((Object(name="thing", mesh=mesh, up_axis="y", scale=1.0 / 3.0),), on, size=(36, 24))
    (tmp_path / "scenes").mkdir()
    path = tmp_path / "scenes" / "made.toml"
    save_scene(path, scene)
    again = ldtrefl.load_scene(path)
    assert 'mesh = "../meshes/corner.obj"' in path.read_text()
    objects = (dataclasses.replace(again.objects[0], mesh=mesh), *again.objects[1:])
    assert dataclasses.replace(again, objects=objects) == scene
    np.testing.assert_array_equal(ldtrefl.render(again).image, ldtrefl.render(scene).image)


def test_all_that_a_scene_may_hold_is_written(tmp_path: Path) -> None:
    ldtrefl.save_image(tmp_path / "sky.exr", np.ones((2, 4, 3)))
    ldtrefl.save_image(tmp_path / "wood.png", np.ones((2, 2, 3)))
    scene = Scene(
        camera=ldtrefl.Camera(eye=(0.0, -5.0, 1e-7), look_at=(0.0, 0.0, 1e15), up=(0.0, 1.0, 0.0)),
        environment=Environment(image=str(tmp_path / "sky.exr")),
        lighting=ldtrefl.Lighting(occlusion=ldtrefl.Occlusion(distance=0.5)),
        lights=(
            Light(kind="point", position=(1.0, 2.0, 3.0), intensity=4.0),
            Light(kind="sphere", position=(1.0, 2.0, 3.0), radius=0.5, radiance=4.0, samples=9, visible=False),
            Light(kind="spot", position=(1.0, 2.0, 3.0), direction=(0.0, 0.0, -1.0), intensity=4.0, outer_angle=20.0),
        ),
        objects=(
            Object(shape="torus_knot", params={"p": 3, "segments": [60, 8]}, fit=2.0, smooth=False),
            Object(shape="box", scale=(1.0, 2.0, 3.0), material=Material(texture=str(tmp_path / "wood.png"))),
            Object(shape="sphere", material=Material(albedo=0.0, mirror=0.5, fresnel=True)),
            Object(shape="sphere", material=Material(albedo=0.25, mirror=0.5, double_sided=False)),
            Object(shape="plane", material=Material(double_sided=True)),
        ),
        reflection=Reflection(method="bvh", max_bounces=2),
        picture=Picture(exposure=-0.5, tone_mapping="agx"),
    )
    save_scene(tmp_path / "all.toml", scene)
    again = ldtrefl.load_scene(tmp_path / "all.toml")
    assert again.objects[1].texture is scene.objects[1].texture is not None
    assert str(again.environment.image) == str(tmp_path / "sky.exr")
    assert again == scene


@pytest.mark.parametrize(
    "environment",
    [
        Environment(preset="sunset", sun_azimuth=15.0, ground_albedo=0.2, rotation=-30.0),
        Environment(preset="studio", strength=0.7),
        Environment(sky=0.5),
    ],
    ids=lambda environment: str(environment.preset),
)
def test_environments_are_written(tmp_path: Path, environment: Environment) -> None:
    scene = dataclasses.replace(composed((Object(shape="sphere"),), None), environment=environment)
    scene = dataclasses.replace(scene, lighting=ldtrefl.Lighting(shadows=True))
    save_scene(tmp_path / "made.toml", scene)
    assert ldtrefl.load_scene(tmp_path / "made.toml") == scene
    written = tomllib.loads((tmp_path / "made.toml").read_text())
    assert len(written["environment"]) == (4 if environment.preset == "sunset" else 2)
    assert written["lighting"] == {"shadows": True}


@pytest.mark.parametrize("name", ['quo"te.obj', "back\\slash.obj", "Straße 🙂.obj", "tab\there.obj", "bell\x7f.obj"])
def test_names_of_any_kind_are_written(tmp_path: Path, name: str) -> None:
    scene = composed((Object(name=name, mesh=on_disk(tmp_path, name)),), None)
    save_scene(tmp_path / "made.toml", scene)
    assert ldtrefl.load_scene(tmp_path / "made.toml").objects[0].name == name


def test_a_key_is_explained_where_it_comes_first() -> None:
    scene = composed((Object(shape="sphere"),), "mirror-ball")
    text = scene_text(scene, Path("made.toml"))
    for comment in ("what a ray sees that hits nothing", "it brings light along", "specular reflectance"):
        assert text.count(comment) == 1
    alone = scene_text(composed((Object(shape="sphere"),), None), Path("made.toml"))
    for comment in ("straight up, blended with the ground", "the way the light travels"):
        assert alone.count(comment) == 1
    written = tomllib.loads(text)
    assert [entry.get("name") for entry in written["object"]][1:3] == ["floor", "mirror ball"]


def test_defaults_are_left_out() -> None:
    text = scene_text(composed((Object(shape="sphere"),), None), Path("made.toml"))
    assert tomllib.loads(text)["object"] == [{"shape": "sphere"}]


def test_a_mesh_that_is_in_no_file_is_refused(tmp_path: Path) -> None:
    mesh = Mesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(ldtrefl.InputError, match=r"made\.toml: the mesh of the object 'mine' is in no file"):
        save_scene(tmp_path / "made.toml", composed((Object(name="mine", mesh=mesh),), None))
    assert not list(tmp_path.iterdir())


def test_where_it_cannot_be_written_is_said(tmp_path: Path) -> None:
    for name, message in (("a.txt", r"name ends in \.toml"), ("none/a.toml", "does not exist"), (".", "ends in")):
        with pytest.raises(ldtrefl.InputError, match=message):
            check_scene_writable(tmp_path / name)
    (tmp_path / "b.toml").mkdir()
    with pytest.raises(ldtrefl.InputError, match="is a folder"):
        check_scene_writable(tmp_path / "b.toml")


def test_what_a_gltf_file_holds_is_included(tmp_path: Path) -> None:
    """Its nodes stand where they stood, in the same picture to the last bit."""
    file = Written()
    mesh = file.quad()
    for x, y in ((3.0, 0.0), (0.0, 2.0)):
        file.add("nodes", {"mesh": mesh, "translation": [x, y, 0.1], "rotation": [0.0, 0.6, 0.0, 0.8]})
    path = file.save(tmp_path)
    for up, turn in (("y", 0.0), ("-x", 0.0), ("y", 35.0), ("-x", -120.0)):
        scene = mesh_scene(path, "mirror-ball", up, turn=turn, size=(36, 24))
        save_scene(tmp_path / "made.toml", scene, include_of(path, up, turn))
        again = ldtrefl.load_scene(tmp_path / "made.toml")
        assert len(again.objects) == len(scene.objects) == 3 + 2
        np.testing.assert_array_equal(ldtrefl.render(again).image, ldtrefl.render(scene).image)
    mixed = composed((*scene.objects[:2], dataclasses.replace(scene.objects[2], material=Material(mirror=0.5))), None)
    with pytest.raises(ldtrefl.InputError, match="is in no file that a scene could name"):
        save_scene(tmp_path / "made.toml", mixed, include_of(path, "y"))


def test_a_lenient_scene_is_lenient_when_it_is_read_again(tmp_path: Path) -> None:
    """Its nodes stay by themselves, also where they are made mirrors."""
    file = Written(extensionsUsed=["ACME_hats"], extensionsRequired=["ACME_hats"])
    file.quad()
    path = file.save(tmp_path)
    for on in ("mirror-ball", "chrome"):
        scene = mesh_scene(path, on, size=(36, 24), lenient=True)
        save_scene(tmp_path / "made.toml", scene, include_of(path, "y", lenient=True))
        again = ldtrefl.load_scene(tmp_path / "made.toml")
        np.testing.assert_allclose(ldtrefl.render(again).image, ldtrefl.render(scene).image, atol=1e-6)  # other order
    text = (tmp_path / "made.toml").read_text()
    assert "lenient = true" in text and 'parts = { "*" = { mirror = [0.93, 0.94, 0.95] } }' in text
    (tmp_path / "made.toml").write_text(text.replace("lenient = true", "lenient = false"))
    with pytest.raises(ldtrefl.InputError, match=r"made\.toml: include\[0\].*ACME_hats.*lenient = true"):
        ldtrefl.load_scene(tmp_path / "made.toml")


def test_the_mirror_that_is_made_of_a_gltf_file_is_written(tmp_path: Path) -> None:
    file = Written()
    file.quad()
    path = file.save(tmp_path)
    scene = mesh_scene(path, "chrome", size=(36, 24))
    save_scene(tmp_path / "made.toml", scene, include_of(path, "y"))
    assert "[[include]]" not in (tmp_path / "made.toml").read_text()
    np.testing.assert_array_equal(
        ldtrefl.render(ldtrefl.load_scene(tmp_path / "made.toml")).image, ldtrefl.render(scene).image
    )
