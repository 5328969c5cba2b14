"""Lights and environment on a device."""

from pathlib import Path

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Scene


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
