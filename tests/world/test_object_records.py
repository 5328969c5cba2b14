"""What kernels read of objects: their matrices and numbers, and what their shading reads."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.world.device_scene import DeviceScene, Uploads

CPU = launch.resolve_device("cpu")
CAMERA = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
PLACED = {"scale": (1.0, 2.0, 0.5), "rotate": (1.0, 2.0, 3.0, 40.0), "translate": (5.0, 1.0, -2.0)}


def on_device(*objects: Object, skip_attributes: bool = True) -> DeviceScene:
    uploads = Uploads(skip_attributes=skip_attributes)
    return DeviceScene(Scene(camera=CAMERA, objects=objects), CPU, uploads=uploads)


def test_matrices_take_unit_space_to_the_device_and_back() -> None:
    scene = on_device(Object(shape="torus", params={"segments": [16, 8]}, **PLACED), Object(shape="box"))
    entry, record = scene.objects[0], scene.records.numpy()[0]
    forth, back = record["device_from_unit"], record["unit_from_device"]
    np.testing.assert_allclose(forth @ back, np.eye(4), atol=1e-12)
    np.testing.assert_array_equal(forth, scene.device_from_world @ entry.world_from_unit)
    world = np.c_[entry.geometry.mesh.vertices, np.ones(len(entry.geometry.mesh.vertices))]
    placed = (scene.device_from_world @ entry.source.world_from_object() @ world.T).T[:, :3]
    unit = entry.geometry.mesh.unit_vertices.astype(float)
    np.testing.assert_allclose(unit @ forth[:3, :3].T + forth[:3, 3], placed, atol=1e-6)
    linear = record["unit_from_direction"] * record["unit_per_device"]
    np.testing.assert_allclose(linear, back[:3, :3], rtol=1e-6, atol=1e-6)
    assert np.frexp(record["unit_per_device"])[0] == 0.5, "a power of two"
    normals = record["normal_from_unit"]
    np.testing.assert_allclose(normals / normals[0, 0], back[:3, :3].T / back[0, 0], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("size", [1e-15, 1e-6, 1.0, 1e14])
def test_powers_of_two_stay_in_float32_whatever_the_size(size: float) -> None:
    scene = on_device(Object(shape="box", scale=size), Object(shape="box", scale=1.0))
    records = scene.records.numpy()
    assert np.isfinite(records["unit_per_device"]).all() and (records["unit_per_device"] > 0.0).all()
    assert np.isfinite(records["unit_from_direction"]).all()


def test_attributes_that_shading_does_not_read_are_left_out() -> None:
    glowing = Material(albedo=0.0, emission=1.0)
    for smooth, material, count in ((True, Material(), 24), (False, Material(), 0), (True, glowing, 0)):
        thing = Object(shape="box", smooth=smooth, material=material)
        record = on_device(thing).records.numpy()[0]
        assert record["normals"]["shape"][0] == count and record["uvs"]["shape"][0] == 0
        every = on_device(thing, skip_attributes=False).records.numpy()[0]
        assert every["normals"]["shape"][0] == every["uvs"]["shape"][0] == 24


def test_floors_and_boxes_are_known_to_see_nothing_of_themselves() -> None:
    """From outside, that is; of meshes with many triangles that is found for mirrors alone."""
    mirror = Material(mirror=0.9)
    shapes = [Object(shape="plane"), Object(shape="box"), Object(shape="sphere"), Object(shape="room")]
    assert on_device(*shapes).records.numpy()["returns"].tolist() == [0, 2, 3, 1]
    (ball,) = on_device(Object(shape="sphere", material=mirror)).records.numpy()
    assert ball["returns"] == 2
