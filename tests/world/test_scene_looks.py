"""Looks of a scene's objects: shared by those that look alike, kept when others change."""

import numpy as np

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Lighting, Material, Object, Scene
from ldtrefl.scene.surface_material import SurfaceMaterial
from ldtrefl.world.device_scene import DeviceScene
from tests.square import square

CPU = launch.resolve_device("cpu")
MESH = square(SurfaceMaterial(emission=(0.25, 0.5, 1.0)))


def scene() -> Scene:
    things = [Object(name=f"square {x}", mesh=MESH, translate=(x, 0, 0), scale=0.4) for x in (-1, 0, 1)]
    camera = Camera(eye=(0, 0, 5), look_at=(0, 0, 0), up=(0, 1, 0), width=24, height=8)
    return Scene(camera=camera, lighting=Lighting(ambient=(0, 0, 0)), objects=(*things, Object(shape="box", scale=0.1)))


def test_objects_that_look_alike_share_a_look_and_plain_ones_have_none() -> None:
    made = DeviceScene(scene().with_object("square 1", material=Material(emission=1.0)), CPU)
    assert made.records.numpy()["look"].tolist() == [0, 0, 1, -1] and made.features.looks
    assert made.looks.records.shape[0] == 2
    assert not DeviceScene(scene().with_objects({}).with_object("square 1"), CPU).looks.records.shape[0] == 0


def test_a_changed_material_is_seen_and_an_earlier_frame_stays() -> None:
    renderer = ldtrefl.Renderer(scene(), "bvh")
    before = renderer.render().image
    changed = scene().with_object("square 0", material=Material(emission=(1.0, 0.0, 0.0)))
    after = ldtrefl.Renderer(changed, "bvh").render().image
    np.testing.assert_allclose(before[4, 12], [0.25, 0.5, 1.0], rtol=1e-6)
    np.testing.assert_allclose(after[4, 12], [1.0, 0.0, 0.0], rtol=1e-6)
    np.testing.assert_array_equal(before[:, :8], after[:, :8])
