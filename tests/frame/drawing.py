"""What a camera sees of some objects, and that it is to the bit the same."""

import numpy as np

from ldtrefl.device import launch
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.device_scene import DeviceScene


def gbuffer(camera: Camera, *objects: Object) -> GBuffer:
    scene = Scene(camera=camera, objects=objects)
    return draw_gbuffer(DeviceScene(scene, launch.resolve_device(None)), camera)


def assert_same(found: GBuffer, expected: GBuffer) -> None:
    np.testing.assert_array_equal(found.objects, expected.objects)
    np.testing.assert_array_equal(found.triangles, expected.triangles)
    np.testing.assert_array_equal(found.reflector_mask, expected.reflector_mask)
