"""Lights and environment on a device."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Object, Scene
from ldtrefl.world.device_scene import DeviceScene
from ldtrefl.world.lighting import BRIGHTEST
from ldtrefl.world.records import LightingRecord


def test_environment_picture_is_looked_up_upright(tmp_path: Path) -> None:
    """For up = +z the middle column is +x, columns run clockwise seen from above, and the top row is up."""
    picture = np.zeros((32, 64, 3), np.float32)
    picture[:, 32 + 16 - 2 : 32 + 16 + 2, 0] = 1.0  # a quarter turn clockwise from +x: -y
    picture[:4, :, 1] = 1.0
    ldtrefl.save_image(tmp_path / "sky.exr", picture)
    sky = Environment(image=str(tmp_path / "sky.exr"))

    def seen(target: tuple[float, float, float], up: tuple[float, float, float] = (0, 0, 1)) -> np.ndarray:
        camera = Camera(eye=(0, 0, 0), look_at=target, up=up, width=1, height=1, fov_y=0.1)
        return ldtrefl.render(Scene(camera=camera, environment=sky)).image[0, 0]

    np.testing.assert_allclose(seen((0, -1, 0)), [1, 0, 0], atol=1e-4)
    np.testing.assert_allclose(seen((0, 1, 0)), [0, 0, 0], atol=1e-4)
    np.testing.assert_allclose(seen((1, 0, 0)), [0, 0, 0], atol=1e-4)
    np.testing.assert_allclose(seen((0.01, 0, 1)), [0, 1, 0], atol=1e-4)


def lighting(scene_size: float, **values: object) -> LightingRecord:
    """The lighting of a box of this size and what is given."""
    camera = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), up=(0, 1, 1), width=4, height=4)
    scene = Scene(camera=camera, objects=(Object(shape="box", scale=scene_size),), **values)
    return DeviceScene(scene, launch.resolve_device("cpu")).lighting


def test_lights_stand_in_device_space() -> None:
    sun = Light(kind="directional", direction=(0, 0, -2), radiance=(1, 2, 3))
    lamp = Light(kind="point", position=(0, 0, 8), intensity=(16, 32, 0))
    record = lighting(4.0, lights=(sun, lamp), lighting=Lighting(shadows=True, ambient=0.5))
    first, second = record.lights.numpy()
    assert first["is_point"] == 0 and first["towards"].tolist() == [0, 0, 1] and first["radiance"].tolist() == [1, 2, 3]
    # Device units are four times as long: intensity falls with their square.
    assert (
        second["is_point"] == 1
        and second["position"].tolist() == [0, 0, 2]
        and second["radiance"].tolist() == [1, 2, 0]
    )
    assert record.shadows == 1 and list(record.ambient) == [0.5] * 3
    np.testing.assert_allclose(list(record.up), [0, np.sqrt(0.5), np.sqrt(0.5)], rtol=1e-6)


def test_the_brightest_light_of_the_smallest_scene_is_finite() -> None:
    lamp = Light(kind="point", position=(0, 0, 8), intensity=1e15)
    (light,) = lighting(1e-14, lights=(lamp,)).lights.numpy()
    assert light["radiance"].tolist() == [np.float32(BRIGHTEST)] * 3


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_a_picture_is_kept_as_it_is_stored(tmp_path: Path, kind: str) -> None:
    ldtrefl.save_image(tmp_path / f"sky.{kind}", np.full((4, 8, 3), 0.5, np.float32))
    record = lighting(1.0, environment=Environment(image=str(tmp_path / f"sky.{kind}")))
    assert list(record.image_size) == [4, 8]
    used, unused = (record.image_bytes, record.image) if kind == "png" else (record.image, record.image_bytes)
    assert used.shape == (4, 8) and unused.shape == (0, 0)
    assert list(lighting(1.0).image_size) == [0, 0]
