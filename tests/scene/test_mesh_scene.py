"""A mesh file as a scene."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.mesh_scene import mesh_scene, parts_of_file, up_axis_of

OBJ = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
"""A tetrahedron that is 1 long in x, 2 in y and 3 in z."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "corner.obj"
    path.write_text(OBJ)
    return path


@pytest.mark.parametrize(
    ("name", "axis"),
    [("a.glb", "y"), ("A.GLTF", "y"), ("a.obj", "y"), ("a.ply", "z"), ("a.stl", "z"), ("a.off", "z"), ("a.3mf", "z")],
)
def test_what_points_up_depends_on_the_kind_of_file(name: str, axis: str) -> None:
    assert up_axis_of(Path(name), None) == axis and up_axis_of(Path(name), "-x") == "-x"


@pytest.mark.parametrize(("up", "height"), [(None, 2.0), ("x", 1.0), ("-y", 2.0), ("z", 3.0)])
def test_it_stands_upright(file: Path, up: str | None, height: float) -> None:
    box = mesh_scene(file, up=up).layout.box
    assert box[1, 2] - box[0, 2] == height


def test_the_object_has_the_name_of_the_file(file: Path) -> None:
    (entry,) = parts_of_file(file, "z").objects
    assert (entry.name, entry.mesh, entry.up_axis) == ("corner", str(file), "z")


def test_options_reach_the_scene(file: Path) -> None:
    scene = ldtrefl.load_scene(file, on="mirror-ball", mirror_self=True, size=(30, 20))
    assert scene.objects[0].is_reflector and scene.number_of("mirror ball") == 2
    assert (scene.camera.width, scene.camera.height) == (30, 20)
    assert np.isfinite(ldtrefl.render(scene).image).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"on": "ball"}, r"unknown stage 'ball' \(allowed: chrome, mirror-ball, mirror-floor, studio\)"),
        ({"up": "w"}, r"unknown axis 'w' \(allowed: -x, -y, -z, x, y, z\)"),
        ({"size": (0, 20)}, r"size: should be width and height, each a whole number from 1 to 16384, got \(0, 20\)"),
    ],
)
def test_what_is_not_allowed_is_refused(file: Path, options: dict[str, object], message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=message):
        ldtrefl.load_scene(file, **options)  # type: ignore[arg-type]


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ldtrefl.InputError, match=r"none\.ply: no such mesh"):
        ldtrefl.load_scene(tmp_path / "none.ply")
