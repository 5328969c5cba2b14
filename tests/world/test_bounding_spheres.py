"""Bounding spheres hold every vertex that is used, and no more than they must."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.world.device_scene import DeviceScene

CAMERA = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
SCALES = {"alike": 1.5, "stretched": (1.0, 2.0, 0.5), "flattened": (3.0, 3.0, 1e-6), "nearly alike": (1.0, 1.0, 1.0001)}


def with_a_stray_vertex(shape: str) -> Mesh:
    """A shape with a vertex far outside that no triangle has."""
    given = Object(shape=shape, params={"segments": [24, 12]}).geometry
    return Mesh(np.r_[given.vertices, [[50.0, 0.0, 0.0]]], given.faces)


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
def test_the_sphere_holds_every_vertex_that_is_used_and_touches_the_farthest(scale: object) -> None:
    place = {"scale": scale, "rotate": (1.0, 2.0, 3.0, 40.0), "translate": (5.0, 1.0, -2.0)}
    meshes = [with_a_stray_vertex(shape) for shape in ("torus", "torus_knot")]
    objects = tuple(Object(mesh=meshes[k % 2], **place) for k in range(4))  # type: ignore[arg-type]
    scene = DeviceScene(Scene(camera=CAMERA, objects=objects), launch.resolve_device("cpu"))
    for entry in scene.objects:
        matrix = scene.device_from_world @ entry.world_from_unit
        mesh = entry.geometry.mesh
        placed = mesh.unit_vertices[mesh.is_used].astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
        farthest = np.linalg.norm(placed - entry.centre, axis=1).max()
        assert farthest < entry.radius < farthest * 1.00002 + 3e-6
