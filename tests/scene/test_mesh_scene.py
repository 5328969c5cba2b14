"""A mesh file as a scene."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.layout import Layout
from ldtrefl.scene.mesh_scene import FROM_Y_UP, is_gltf, mesh_scene, parts_of_file, up_axis_of
from ldtrefl.scene.placement import UpAxis
from tests.mesh_writers import packed
from tests.scene.gltf.writer import Written

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


@pytest.mark.parametrize("ending", ["gz", "bz2", "zip", "tar.gz"])
def test_what_is_packed_is_what_it_is_unpacked(tmp_path: Path, file: Path, ending: str) -> None:
    """An OBJ file has y up, a GLB file its nodes, in an archive, too."""
    for source, name in ((file, "corner.obj"), (gltf(tmp_path, name="sign.glb"), "sign.glb")):
        path = packed(tmp_path / f"{name}.{ending}", name, source.read_bytes())
        plain, scene = ldtrefl.load_scene(source), ldtrefl.load_scene(path)
        np.testing.assert_array_equal(scene.layout.box, plain.layout.box)
        assert is_gltf(path) == name.endswith("glb") and up_axis_of(path, None) == "y"
        if is_gltf(path):
            assert [entry.name for entry in scene.objects] == ["sign"]


def test_kinds_that_differ_in_an_archive_have_z_up(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        for name in ("a.obj", "a.ply"):
            archive.writestr(name, "")
    (tmp_path / "b.zip").write_bytes(b"no archive")
    for name in ("a.zip", "b.zip"):
        assert up_axis_of(tmp_path / name, None) == "z" and not is_gltf(tmp_path / name)


@pytest.mark.parametrize(("up", "height"), [(None, 2.0), ("x", 1.0), ("-y", 2.0), ("z", 3.0)])
def test_it_stands_upright(file: Path, up: str | None, height: float) -> None:
    box = mesh_scene(file, up=up).layout.box
    assert box[1, 2] - box[0, 2] == height


@pytest.mark.parametrize("up", FROM_Y_UP)
@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_it_is_turned_about_what_is_up(tmp_path: Path, file: Path, kind: str, up: UpAxis) -> None:
    """By 90 degrees what pointed at the camera, to -y, points to +x. Nothing else of it changes."""
    path = file if kind == "obj" else gltf(tmp_path, name="sign.glb")
    (before,), (after,) = (parts_of_file(path, up, turn=turn).objects for turn in (0.0, 90.0))
    x, y, z = (before.geometry.vertices @ before.world_from_object()[:3, :3].T).T
    turned = after.geometry.vertices @ after.world_from_object()[:3, :3].T
    np.testing.assert_allclose(turned, np.column_stack([-y, x, z]), atol=1e-12)


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
        ({"turn": float("nan")}, "turn: should be degrees from -360 to 360, got nan"),
        ({"turn": 400.0}, "turn: should be degrees from -360 to 360, got 400"),
        ({"size": (0, 20)}, r"size: should be width and height, each a whole number from 1 to 16384, got \(0, 20\)"),
    ],
)
def test_what_is_not_allowed_is_refused(file: Path, options: dict[str, object], message: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=message):
        ldtrefl.load_scene(file, **options)  # type: ignore[arg-type]


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ldtrefl.InputError, match=r"none\.ply: no such mesh"):
        ldtrefl.load_scene(tmp_path / "none.ply")


def gltf(folder: Path, name: str = "sign.gltf", **more: object) -> Path:
    """A file with a rectangle, from (0, 0, 0) to (2, 1, 0), in a node with a name; y is up and its front +z."""
    file = Written(**more)
    file.add("nodes", {"mesh": file.quad(place=False), "name": "sign"})
    return file.save(folder, name)


def test_nodes_of_a_gltf_file_are_objects(tmp_path: Path) -> None:
    scene = ldtrefl.load_scene(gltf(tmp_path), on="studio")
    assert [entry.name for entry in scene.objects] == ["sign", "floor"]
    np.testing.assert_array_equal(parts_box(gltf(tmp_path), "y"), [[0.0, 0.0, 0.0], [2.0, 0.0, 1.0]])


def parts_box(path: Path, up: UpAxis) -> np.ndarray:
    """(2, 3): where the objects of a file stand."""
    return Layout.of(parts_of_file(path, up).objects).box


@pytest.mark.parametrize("up", FROM_Y_UP)
def test_a_gltf_file_stands_upright_as_any_other_does(tmp_path: Path, up: UpAxis) -> None:
    """Whatever points up in it comes to +z, by the same turn as of one object with ``up_axis``."""
    path = gltf(tmp_path)
    one = parts_of_file(path, up, as_one=True)
    assert len(one.objects) == 1 and one.objects[0].name == "sign"
    box, whole = parts_box(path, up), Layout.of(one.objects).box
    np.testing.assert_allclose(box, whole, atol=1e-12)


def test_its_own_camera_and_lights_count_without_a_stage(tmp_path: Path) -> None:
    """A camera 5 in front of the rectangle, a light of pi lux from the front, and little else: the picture has
    their colours."""
    path = gltf(
        tmp_path,
        cameras=[{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 1.5}}],
        extensionsUsed=["KHR_lights_punctual"],
        extensions={
            "KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": np.pi, "color": [1, 0.5, 0]}]}
        },
        nodes=[
            {"camera": 0, "translation": [1.0, 0.5, 5.0]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
    )
    alone = ldtrefl.load_scene(path, size=(30, 20))
    np.testing.assert_allclose(alone.camera.eye, [1.0, -5.0, 0.5])
    assert len(alone.lights) == 1 and alone.lights[0].radiance == pytest.approx((1.0, 0.5, 0.0))
    middle = ldtrefl.render(alone).image[10, 15]
    np.testing.assert_allclose(middle / middle[0], np.array([1.05, 0.55, 0.05]) / 1.05, rtol=1e-3)
    turned = ldtrefl.load_scene(path, size=(30, 20), turn=30.0)
    assert (turned.camera, turned.lights) == (alone.camera, alone.lights), "what is looked at is turned"
    staged = ldtrefl.load_scene(path, on="studio", size=(30, 20))
    assert staged.lights == () and staged.camera.eye != alone.camera.eye


def test_what_a_file_requires_and_is_not_read_is_refused_or_left_out(tmp_path: Path) -> None:
    path = gltf(tmp_path, extensionsUsed=["EXT_none"], extensionsRequired=["EXT_none"])
    with pytest.raises(ldtrefl.InputError, match="it requires EXT_none, which is not read"):
        ldtrefl.load_scene(path)
    for options in ({}, {"on": "chrome"}):
        assert ldtrefl.load_scene(path, lenient=True, **options).objects[0].name == "sign"


def test_a_name_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "\udcff.obj"
    path.write_text(OBJ)
    with pytest.raises(ldtrefl.InputError, match="a mesh file's name must be text in UTF-8"):
        ldtrefl.load_scene(path)
