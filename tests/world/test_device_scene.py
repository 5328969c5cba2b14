"""The scene on a device: what is the same in content is there once, whatever it was made of."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.files import content_key, stored_picture
from ldtrefl.scene import mesh as mesh_module
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.world.device_scene import DeviceScene

CAMERA = Camera(eye=(0, -5, 1), look_at=(0, 0, 0), width=24, height=16)
MIRROR = Object(shape="sphere", params={"segments": [32, 16]}, material=Material(mirror=(0.9, 0.9, 0.9)))


def write_mesh(path: Path) -> str:
    """A text file of a sheet with texture coordinates."""
    path.write_text("v -1 0 -1\nv 1 0 -1\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    return str(path)


def write_picture(path: Path) -> str:
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (8, 8, 3), dtype=np.uint8)).save(path)
    return str(path)


def twins(tmp_path: Path) -> Scene:
    """A mirror and two sheets of equal files with other names, equal textures too."""
    things = []
    for k in range(2):
        mesh, texture = write_mesh(tmp_path / f"{k}.obj"), write_picture(tmp_path / f"{k}.png")
        things.append(
            Object(name=f"{k}", mesh=mesh, material=Material(texture=texture), translate=(k - 0.5, -2.0, 0.0))
        )
    return Scene(camera=CAMERA, lighting=Lighting(shadows=True), objects=(MIRROR, *things))


def test_equal_meshes_and_textures_share_what_is_on_the_device(tmp_path: Path) -> None:
    scene = twins(tmp_path)
    first, second = scene.objects[1:]
    assert first.geometry is not second.geometry and first.geometry.key == second.geometry.key
    assert first.texture is not second.texture
    on_device = DeviceScene(scene, launch.resolve_device(None))
    assert on_device.objects[1].geometry is on_device.objects[2].geometry is not on_device.objects[0].geometry
    records = on_device.records.numpy()[1:]
    for name in ("vertices", "faces", "normals", "uvs", "texels", "texel_bytes", "part_texture"):
        assert records[name]["data"][0] == records[name]["data"][1], name
    assert on_device.triangle_counts.tolist() == [len(MIRROR.geometry.faces), 1, 1]
    assert on_device.vertex_counts.tolist() == [len(MIRROR.geometry.vertices), 3, 3]


def test_equal_meshes_share_maps_and_trees(tmp_path: Path) -> None:
    scene = twins(tmp_path)
    maps = ldtrefl.render(scene, "ldt").stats.counters["objects_peeled"]
    assert maps == len({entry.geometry.key for entry in scene.objects}) == 2
    renderer = ldtrefl.Renderer(scene, "bvh")
    image = renderer.render().image
    np.testing.assert_array_equal(image, ldtrefl.render(scene, "bvh").image)


def test_a_mesh_with_other_normals_or_texture_is_another(tmp_path: Path) -> None:
    """It has device arrays of its own, but the same surface."""
    sphere = shapes.make("sphere", {"segments": [32, 16]})
    turned = sphere.with_normals(-sphere.normals)
    assert turned.key != sphere.key and turned.surface_key == sphere.surface_key
    objects = tuple(Object(mesh=mesh) for mesh in (sphere, turned))
    on_device = DeviceScene(Scene(camera=CAMERA, objects=objects), launch.resolve_device(None))
    first, second = on_device.objects
    np.testing.assert_array_equal(second.geometry.normals.numpy(), -sphere.normals)
    np.testing.assert_array_equal(first.geometry.normals.numpy(), sphere.normals)
    pointers = on_device.records.numpy()["normals"]["data"].tolist()
    assert pointers == [first.geometry.normals.ptr, second.geometry.normals.ptr]


def test_a_moved_object_is_not_hashed_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor are files read again: a texture or a sky that has changed since is another scene's."""
    scene = twins(tmp_path)
    scene = Scene(
        camera=CAMERA, objects=scene.objects, environment=Environment(image=write_picture(tmp_path / "sky.png"))
    )
    renderer = ldtrefl.Renderer(scene, "bvh")
    before = renderer.render().image
    for name in ("0.obj", "0.png", "sky.png"):
        (tmp_path / name).write_bytes(b"")

    def fail(*contents: object) -> str:
        raise AssertionError("hashed again")

    for module in (content_key, stored_picture, mesh_module):
        monkeypatch.setattr(module, "content_key", fail)
    renderer.move("0", translate=(0.5, -3.0, 0.5))
    assert (renderer.render().image != before).any()
    renderer.move("0", translate=(-0.5, -2.0, 0.0))
    np.testing.assert_array_equal(renderer.render().image, before)


def test_a_copied_file_is_the_same_mesh(tmp_path: Path) -> None:
    first = ldtrefl.load_mesh(write_mesh(tmp_path / "a.obj"))
    shutil.copy(tmp_path / "a.obj", tmp_path / "b.obj")
    assert ldtrefl.load_mesh(tmp_path / "b.obj").key == first.key


def test_what_an_object_leaves_as_it_was_is_taken_over(tmp_path: Path) -> None:
    """The records of a moved scene are those of the same scene anew, and those of the scene before stay."""
    scene, cpu = twins(tmp_path), launch.resolve_device(None)
    before = DeviceScene(scene, cpu)
    kept = before.records.numpy().copy()
    changes = {"translate": (0.5, 1.0, 0.0), "material": Material(mirror=0.5, emission=1.0), "smooth": False}
    moved = scene.with_object("1", **changes)
    after, anew = DeviceScene(moved, cpu, before), DeviceScene(moved, cpu)
    for name in set(kept.dtype.names or ()) - {"normals", "uvs", "vertices", "faces", "texels", "texel_bytes"}:
        if kept.dtype[name].names is None:
            np.testing.assert_array_equal(after.records.numpy()[name], anew.records.numpy()[name], err_msg=name)
    np.testing.assert_array_equal(after.spheres, anew.spheres)
    np.testing.assert_array_equal(after.world_from_unit, anew.world_from_unit)
    assert after.meshes is before.meshes and after.moved_since(before) == {2}
    assert after.is_reflector.tolist() == [True, False, True]
    assert before.is_reflector.tolist() == [True, False, False]
    assert (before.records.numpy() == kept).all() and not (after.records.numpy() == kept).all()


def test_an_object_with_another_mesh_moves_the_numbers_of_those_after_it() -> None:
    objects = (Object(name="a", shape="box"), Object(name="b", shape="box", translate=(3, 0, 0)))
    scene, cpu = Scene(camera=CAMERA, objects=objects), launch.resolve_device(None)
    changed = scene.with_object("a", shape="plane")
    after = DeviceScene(changed, cpu, DeviceScene(scene, cpu))
    assert after.triangle_numbers.first.numpy().tolist() == [0, 2] and after.triangle_counts.tolist() == [2, 12]


def test_no_objects() -> None:
    empty = DeviceScene(Scene(camera=CAMERA), launch.resolve_device(None))
    assert len(empty.objects) == 0 and empty.records.shape == (0,) and empty.reflectors == []


def test_mirrors_of_more_triangles_than_can_be_numbered_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ldtrefl.world.device_scene.MOST_NUMBERS", 100)
    mirrors = tuple(Object(shape="box", material=Material(mirror=0.5)) for _ in range(9))
    with pytest.raises(ldtrefl.InputError, match="the mirrors have more than 100 triangles, instances counted in"):
        ldtrefl.render(Scene(camera=CAMERA, objects=mirrors), "ldt", cull="flat")
