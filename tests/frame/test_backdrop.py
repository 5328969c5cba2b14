"""Pixels that see nothing but the environment, against its closed form in float64."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Object, Scene

TWO = Environment(sky=(0.2, 1.0, 3.0), ground=(0.9, 0.1, 0.4))


def directions(camera: Camera) -> np.ndarray:
    """(h, w, 3) unit directions through pixel centres."""
    forward = np.subtract(camera.look_at, camera.eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    half = np.tan(np.radians(camera.fov_y) / 2.0)
    x = (2.0 * (np.arange(camera.width) + 0.5) / camera.width - 1.0) * half * camera.width / camera.height
    y = (2.0 * (np.arange(camera.height) + 0.5) / camera.height - 1.0) * half
    way = forward + x[None, :, None] * right + y[:, None, None] * down
    return way / np.linalg.norm(way, axis=2, keepdims=True)


@pytest.mark.parametrize("fov", [1e-3, 40.0, 170.0])
@pytest.mark.parametrize(("width", "height"), [(1, 1), (7, 5), (83, 31), (1601, 9), (8, 64)])
def test_two_colours(width: int, height: int, fov: float) -> None:
    camera = Camera(eye=(1, -4, 2), look_at=(0, 0, 1), up=(0.1, 0.2, 1.0), width=width, height=height, fov_y=fov)
    image = ldtrefl.render(Scene(camera=camera, environment=TWO), "bvh").image
    up = np.array(camera.up) / np.linalg.norm(camera.up)
    blend = 0.5 + 0.5 * (directions(camera) @ up)[..., None]
    np.testing.assert_allclose(image, blend * TWO.sky + (1.0 - blend) * TWO.ground, rtol=3e-6, atol=1e-6)


def test_between_objects_pixels_have_the_bits_that_they_have_without_them() -> None:
    camera = Camera(eye=(0, -5, 1), look_at=(0, 0, 0), width=97, height=45)
    rng = np.random.default_rng(3)
    balls = tuple(Object(shape="sphere", scale=0.1, translate=tuple(rng.uniform(-1.5, 1.5, 3))) for _ in range(20))
    renderer = ldtrefl.Renderer(Scene(camera=camera, environment=TWO, objects=balls), "bvh")
    image = renderer.render().image
    assert renderer.gbuffer is not None
    nothing = renderer.gbuffer.objects < 0
    assert 0.3 < nothing.mean() < 0.98
    alone = ldtrefl.render(Scene(camera=camera, environment=TWO), "bvh").image
    np.testing.assert_allclose(image[nothing], alone[nothing], rtol=1e-6)
