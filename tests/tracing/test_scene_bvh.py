"""The BVHs of a scene: one for each mesh, built when the first ray needs one, and kept when objects move."""

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.device.stats import Stats
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.tracing.scene_bvh import SceneBvh
from ldtrefl.world.device_scene import DeviceScene

CAMERA = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)


def test_objects_of_one_mesh_share_a_tree_that_is_built_once() -> None:
    boxes = tuple(Object(name=f"{k}", shape="box", translate=(3.0 * k, 0, 0)) for k in range(3))
    scene = Scene(camera=CAMERA, objects=(*boxes, Object(shape="torus", params={"segments": [12, 6]})))
    device_scene = DeviceScene(scene, launch.resolve_device(None))
    trees, first, second = SceneBvh(), Stats(), Stats()
    bound = trees.bound(device_scene, {0}, first)
    assert len(bound.views) == 4 and len(trees._owners) == 2 and first.seconds["build"] > 0.0
    assert trees.bound(device_scene, {0, 1, 2, 3}, second) is bound and "build" not in second.seconds


def test_a_moved_object_keeps_its_tree() -> None:
    mirror = ldtrefl.Material(mirror=1.0)
    ball = Object(shape="sphere", params={"segments": [24, 12]}, material=mirror)
    renderer = ldtrefl.Renderer(
        Scene(camera=CAMERA, objects=(ball, Object(name="box", shape="box", translate=(0, 3, 2)))), "bvh"
    )
    assert "build" in renderer.render().stats.seconds
    renderer.move("box", translate=(0, -3, 2))
    assert renderer.render().stats.seconds.get("build", 0.0) == 0.0
