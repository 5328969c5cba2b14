"""An object in device space: its matrices, its sphere, and what its shading reads."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.world.device_object import bounding_sphere
from ldtrefl.world.device_scene import DeviceScene

CPU = launch.resolve_device("cpu")
CAMERA = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
PLACED = {"scale": (1.0, 2.0, 0.5), "rotate": (1.0, 2.0, 3.0, 40.0), "translate": (5.0, 1.0, -2.0)}


def on_device(*objects: Object, skip_attributes: bool = True) -> DeviceScene:
    return DeviceScene(Scene(camera=CAMERA, objects=objects), CPU, skip_attributes=skip_attributes)


def as_matrix(matrix: wp.mat44d) -> np.ndarray:
    """A matrix of Warp's as float64."""
    values = np.array(list(matrix), float)
    return values.reshape(4, 4) if values.size == 16 else values.reshape(3, 3)


def test_matrices_take_unit_space_to_the_device_and_back() -> None:
    scene = on_device(Object(shape="torus", params={"segments": [16, 8]}, **PLACED), Object(shape="box"))
    entry = scene.objects[0]
    forth, back = (as_matrix(matrix) for matrix in (entry.record.device_from_unit, entry.record.unit_from_device))
    np.testing.assert_allclose(forth @ back, np.eye(4), atol=1e-12)
    world = np.c_[entry.geometry.mesh.vertices, np.ones(len(entry.geometry.mesh.vertices))]
    placed = (scene.device_from_world @ entry.source.world_from_object() @ world.T).T[:, :3]
    unit = entry.geometry.mesh.unit_vertices.astype(float)
    np.testing.assert_allclose(unit @ forth[:3, :3].T + forth[:3, 3], placed, atol=1e-6)
    linear = as_matrix(entry.record.unit_from_direction) * entry.record.unit_per_device
    np.testing.assert_allclose(linear, back[:3, :3], rtol=1e-6, atol=1e-6)
    assert np.frexp(entry.record.unit_per_device)[0] == 0.5, "a power of two"
    normals = as_matrix(entry.record.normal_from_unit)
    np.testing.assert_allclose(normals / normals[0, 0], back[:3, :3].T / back[0, 0], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("size", [1e-15, 1e-6, 1.0, 1e14])
def test_powers_of_two_stay_in_float32_whatever_the_size(size: float) -> None:
    scene = on_device(Object(shape="box", scale=size), Object(shape="box", scale=1.0))
    for entry in scene.objects:
        assert np.isfinite(np.float32(entry.record.unit_per_device)) and entry.record.unit_per_device > 0.0
        assert np.isfinite(np.array(entry.record.unit_from_direction)).all()


def test_the_sphere_holds_every_vertex_that_is_used() -> None:
    scene = on_device(Object(shape="torus", params={"segments": [16, 8]}, **PLACED), Object(shape="box"))
    entry = scene.objects[0]
    matrix = as_matrix(entry.record.device_from_unit)
    placed = entry.geometry.mesh.unit_vertices.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    centre, radius = bounding_sphere(entry.geometry.mesh, matrix)
    farthest = np.linalg.norm(placed - np.array(centre, float), axis=1).max()
    assert farthest < radius < farthest * 1.0001 + 1e-5


def test_triangles_and_vertices_are_numbered_through_all_objects() -> None:
    scene = on_device(*(Object(shape="box", translate=(3.0 * k, 0, 0)) for k in range(3)))
    assert [entry.record.first_triangle for entry in scene.objects] == [0, 12, 24]
    assert [entry.record.first_vertex for entry in scene.objects] == [0, 24, 48] and scene.vertex_count == 72
    assert scene.objects[0].vertex_count == 24 and scene.objects[0].triangle_count == 12
    assert scene.objects[0].longest_side == 2.0


def test_attributes_that_shading_does_not_read_are_left_out() -> None:
    glowing = Material(albedo=0.0, emission=1.0)
    for smooth, material, count in ((True, Material(), 24), (False, Material(), 0), (True, glowing, 0)):
        thing = Object(shape="box", smooth=smooth, material=material)
        record = on_device(thing).objects[0].record
        assert record.normals.shape == (count,) and record.uvs.shape == (0,)
        every = on_device(thing, skip_attributes=False).objects[0].record
        assert every.normals.shape == every.uvs.shape == (24,)
