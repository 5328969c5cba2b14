"""The BVHs of a scene: built once, one a mesh, and a view of each object's own."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device.stats import Stats
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.tracing.bvh import BVH, Raycaster
from ldtrefl.tracing.scene_bvh import SceneBvh
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_scene import DeviceScene
from tests.tracing.boxes import scene_of


def test_every_mesh_has_one_tree_that_is_built_once(monkeypatch: pytest.MonkeyPatch) -> None:
    built: list[DeviceMesh] = []
    of = Raycaster.of

    def counted(geometry: DeviceMesh) -> Raycaster:
        built.append(geometry)
        return of(geometry)

    monkeypatch.setattr(Raycaster, "of", counted)
    scene, bvhs, stats = scene_of(np.eye(3)), SceneBvh(), Stats()
    assert built == [] and stats.seconds == {}, "nothing is built before it is needed"
    tracer = bvhs.bound(scene, {1}, stats)
    assert tracer.tracer is BVH and tracer.views.shape == (3,)
    assert built == [scene.objects[0].geometry], "three boxes are one mesh"
    assert set(stats.seconds) == {"build"}
    assert bvhs.bound(scene, {0, 1, 2}, Stats()) is tracer and len(built) == 1
    # Objects that move take their trees with them.
    again = Stats()
    moved = DeviceScene(scene.scene.with_object(scene.scene.objects[1].name, translate=(5, 5, 5)), scene.device, scene)
    assert bvhs.bound(moved, {0}, again) is tracer and again.seconds == {}


def test_a_moved_object_keeps_its_tree() -> None:
    mirror = Material(mirror=1.0)
    ball = Object(shape="sphere", params={"segments": [24, 12]}, material=mirror)
    box = Object(name="box", shape="box", translate=(0, 3, 2))
    camera = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
    renderer = ldtrefl.Renderer(Scene(camera=camera, objects=(ball, box)), "bvh")
    assert "build" in renderer.render().stats.seconds
    renderer.move("box", translate=(0, -3, 2))
    assert renderer.render().stats.seconds.get("build", 0.0) == 0.0
