"""What rays bring where they end, and how they go on from mirrors."""

import dataclasses

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Light, Lighting, Material, Object, Scene

BALL = Object(shape="sphere", material=Material(albedo=0.0, mirror=(0.5, 0.25, 1.0)))
SKY = Environment(sky=(0.2, 0.4, 0.8), ground=(0.2, 0.4, 0.8))
CAMERA = Camera(eye=(0, -5, 0), look_at=(0, 0, 0), fov_y=10.0, width=9, height=9)


def middle(scene: Scene, **options: object) -> np.ndarray:
    """(3,) radiance of the picture's middle."""
    return ldtrefl.render(scene, "bvh", **options).image[4, 4]


def test_a_ray_that_ends_at_nothing_brings_the_environment() -> None:
    scene = Scene(camera=CAMERA, environment=SKY, objects=(BALL,))
    np.testing.assert_allclose(middle(scene), np.multiply(SKY.sky, BALL.material.mirror), rtol=1e-5)


def test_a_ray_that_meets_a_light_first_brings_its_radiance() -> None:
    light = Light(kind="sphere", position=(0, -9, 0), radius=1.0, radiance=(3.0, 2.0, 1.0))
    scene = Scene(camera=CAMERA, environment=SKY, objects=(BALL,), lights=(light,), lighting=Lighting(ambient=0.0))
    np.testing.assert_allclose(middle(scene), np.multiply((3.0, 2.0, 1.0), BALL.material.mirror), rtol=1e-5)
    wall = Object(shape="box", translate=(0, -7, 0), scale=0.5, material=Material(albedo=0.0, emission=0.125))
    hidden = dataclasses.replace(scene, objects=(BALL, wall))
    np.testing.assert_allclose(middle(hidden), 0.125 * np.array(BALL.material.mirror), rtol=1e-5)
