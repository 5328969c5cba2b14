"""The tracer that meets nothing: a scene without shadows is as bright as one whose light nothing stands in."""

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Camera, Light, Lighting, Object, Scene


def test_without_shadows_a_floor_is_lit_under_a_box() -> None:
    floor, box = Object(shape="plane", scale=2.0), Object(shape="box", scale=0.1, translate=(0, 0, 5))
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(1, 1, 1))
    camera = Camera(eye=(0, -3, 2), look_at=(0, 0, 0), width=24, height=16, fov_y=20)
    open_scene = Scene(camera=camera, lights=(light,), objects=(floor,), lighting=Lighting(shadows=False))
    with_box = Scene(camera=camera, lights=(light,), objects=(floor, box), lighting=Lighting(shadows=False))
    shadowed = Scene(camera=camera, lights=(light,), objects=(floor, box), lighting=Lighting(shadows=True))
    images = [ldtrefl.render(scene, "bvh").image for scene in (open_scene, with_box, shadowed)]
    np.testing.assert_array_equal(images[0], images[1])
    assert (images[2] < images[1]).any()
