"""What a camera sees of some objects."""

from ldtrefl.device import launch
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.frame.visibility import draw_gbuffer
from ldtrefl.scene.description import Camera, Object, Scene
from ldtrefl.world.device_scene import DeviceScene


def gbuffer(camera: Camera, *objects: Object) -> GBuffer:
    scene = Scene(camera=camera, objects=objects)
    return draw_gbuffer(DeviceScene(scene, launch.resolve_device(None)), camera)
