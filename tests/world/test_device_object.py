"""The objects of a scene on a device, as the host sees them."""

import numpy as np
import pytest

from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.device_scene import DeviceScene


def test_objects_are_made_when_they_are_asked_for() -> None:
    sources = [Object(shape=shape, scale=0.5, translate=(k, 0, 0)) for k, shape in enumerate(("box", "torus", "box"))]
    camera = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
    scene = DeviceScene(Scene(camera=camera, objects=tuple(sources)), launch.resolve_device("cpu"))
    assert len(scene.objects) == 3 and [entry.index for entry in scene.objects] == [0, 1, 2]
    assert [entry.source for entry in scene.objects[1:]] == sources[1:] and scene.objects[-1].index == 2
    assert scene.objects[0].geometry is scene.objects[2].geometry is not scene.objects[1].geometry
    assert [entry.longest_side for entry in scene.objects[::2]] == [1.0, 1.0]
    np.testing.assert_array_equal([*scene.objects[1].centre, scene.objects[1].radius], scene.spheres[1])
    with pytest.raises(IndexError):
        scene.objects[3]
