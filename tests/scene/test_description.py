"""The scene's dataclasses: what they check, what they fill in, and how a scene is changed."""

import dataclasses
import logging
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Light, Material, Object, Scene

CAMERA = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)


def test_numpys_numbers_and_a_single_number_stand_for_plain_ones() -> None:
    eye, white = np.array([0.0, -5.0, 0.0]), np.float32(1.0)
    assert Camera(eye=eye, look_at=[0, 0, 0], width=np.int64(4), height=4) == CAMERA
    assert Material(albedo=white) == Material(albedo=(1, 1, 1)) == Material(albedo=[1, 1, 1])


@pytest.mark.parametrize(
    ("kind", "values", "message"),
    [
        (Camera, {"eye": (0, 0, 0), "look_at": (0, 0, 0)}, "Camera: eye and look_at are the same point"),
        (Camera, {"eye": (0, 0, 1), "look_at": (0, 0, 0)}, "Camera: up is parallel to the line from eye to look_at"),
        (Light, {"kind": "point", "position": (0, 0, 0)}, "Light: a point light needs 'intensity'"),
        (Light, {"kind": "point", "direction": (0, 0, 1)}, "Light: a point light has no 'direction'"),
        (Object, {}, "Object: needs either 'mesh' or 'shape'"),
        (Object, {"mesh": "a.ply", "params": {"p": 2}}, "Object: 'params' goes with 'shape'"),
        (Object, {"shape": "box", "rotate": (0, 0, 0, 30)}, "Object: rotate: the axis must not be the zero vector"),
        (Object, {"shape": "box", "params": 5}, "Object: params: should be a valid dictionary, got 5"),
    ],
)
def test_wrong_values_are_refused_in_one_line(kind: type, values: dict[str, object], message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=message):
        kind(**values)


def test_an_albedo_that_is_not_given_follows_the_mirror() -> None:
    plain, mirror = Material(), Material(mirror=0.5)
    assert plain.albedo == (0.8, 0.8, 0.8) and mirror.albedo == (0.0, 0.0, 0.0)
    assert dataclasses.replace(plain, mirror=0.5) == mirror and dataclasses.replace(mirror, mirror=0.0) == plain
    assert Material(albedo=0.8, mirror=0.1).albedo == (0.8, 0.8, 0.8)


def test_more_light_than_falls_on_it_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    bright = Object(name="bright one", shape="box", material=Material(albedo=0.7, mirror=(0.2, 0.4, 0.2)))
    dataclasses.replace(bright, translate=(1, 0, 0))
    Object(shape="box", material=Material(albedo=0.9, mirror=0.1))
    said = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    assert len(said) == 1 and "object 'bright one': " in said[0] and "1.1 in green" in said[0]


def test_a_scene_with_an_object_changed() -> None:
    scene = Scene(camera=CAMERA, objects=(Object(name="a", shape="box"), Object(name="b", shape="torus")))
    moved = scene.with_object("b", translate=(1, 0, 0))
    assert moved.objects[0] is scene.objects[0] and moved.objects[1].geometry is scene.objects[1].geometry
    assert scene.with_object("b", shape="box").objects[1].geometry is shapes.make("box")
    for name, changes, message in [
        ("c", {}, "unknown object 'c'"),
        ("b", {"scael": 2.0}, "unknown field of an object 'scael'; did you mean 'scale'"),
        ("b", {"scale": -1.0}, "object 'b': Object: scale: should be from 1e-15"),
    ]:
        with pytest.raises(ldtrefl.InputError, match=message):
            scene.with_object(name, **changes)


def test_a_picture_is_read_once_however_objects_move(tmp_path: Path) -> None:
    ldtrefl.save_image(tmp_path / "a.png", np.zeros((2, 2, 3), np.float32))
    thing = Object(name="a", shape="plane", material=Material(texture=str(tmp_path / "a.png")))
    scene = Scene(camera=CAMERA, objects=(thing,))
    picture = scene.objects[0].texture
    (tmp_path / "a.png").unlink()
    assert scene.with_object("a", scale=2.0).objects[0].texture is picture is not None


def test_equal_shapes_and_files_have_one_mesh_and_are_asked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    make = shapes.make
    monkeypatch.setattr(shapes, "make", lambda name, params: asked.append(name) or make(name, params))
    fine = {"segments": [32, 16]}
    objects = tuple(Object(shape="sphere", params=params, scale=scale) for params in ({}, fine) for scale in (1, 2, 3))
    scene = Scene(camera=CAMERA, objects=objects)
    assert len(scene.layout.meshes) == 2 and scene.layout.mesh_of.tolist() == [0, 0, 0, 1, 1, 1]
    assert asked == ["sphere", "sphere"]
    assert all(entry.geometry is scene.layout.meshes[k // 3] for k, entry in enumerate(objects))


def test_the_object_that_has_no_allowed_size_is_named() -> None:
    objects = (Object(shape="box"), Object(shape="box", fit=1e15, scale=10.0), Object(shape="box"))
    with pytest.raises(ldtrefl.InputError, match=r"^object\[1\]: fit 1e\+15, scale 10.0 and the mesh's own size of 2"):
        ldtrefl.render(Scene(camera=CAMERA, objects=objects))


def test_the_first_of_several_objects_of_one_name_is_meant() -> None:
    objects = tuple(Object(name=name, shape="box") for name in ("a", "b", "b"))
    scene = Scene(camera=CAMERA, objects=objects)
    assert scene.number_of("b") == 1
    assert [entry.translate[0] for entry in scene.with_object("b", translate=(1, 0, 0)).objects] == [0.0, 1.0, 0.0]
