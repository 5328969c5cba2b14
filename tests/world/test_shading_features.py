"""What kernels are built for: nothing that a scene has not."""

import numpy as np

from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Light, Lighting, Object, Scene
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.shading_features import ShadingFeatures

SPOT = Light(kind="spot", position=(0, 0, 3), direction=(0, 0, -1), intensity=1.0)
BALL = Light(kind="sphere", position=(0, 0, 3), radius=0.1, radiance=1.0)


def features(*lights: Light, **lighting: object) -> ShadingFeatures:
    """Of a scene of a box and what is given."""
    camera = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
    scene = Scene(camera=camera, objects=(Object(shape="box"),), lights=lights, lighting=Lighting(**lighting))
    device_scene = DeviceScene(scene, launch.resolve_device("cpu"))
    has_noise = np.array(device_scene.lighting.noise.shape).all()
    assert has_noise == device_scene.features.soft_light
    return device_scene.features


def test_a_scene_has_what_it_says_and_no_more() -> None:
    sun = Light(kind="directional", direction=(0, 0, -1), radiance=1.0)
    assert features(sun) == ShadingFeatures()
    assert features(sun, shadows=True) == ShadingFeatures(shadows=True)
    for soft in (features(occlusion={"distance": 1.0}), features(SPOT, sun), features(BALL)):
        assert soft == ShadingFeatures(soft_light=True)


def test_where_nothing_is_traced_lights_stay() -> None:
    everything = ShadingFeatures(True, True, True, True)
    assert everything.without_rays() == ShadingFeatures(looks=True, soft_light=True)
