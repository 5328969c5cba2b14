"""The ray-casting method: reflections in reflections, and options."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import Camera, Environment, Material, Object, Reflection, Scene

MIRROR = Material(albedo=0.0, mirror=0.5)
SCENE = Scene(
    camera=Camera(eye=(0.0, -6.0, 1.5), look_at=(0.5, 0.0, 0.0), width=60, height=40, fov_y=40),
    environment=Environment(sky=(1.0, 1.0, 1.0), ground=(1.0, 1.0, 1.0)),
    objects=(Object(shape="sphere", material=MIRROR), Object(shape="sphere", translate=(2, -1, 0), material=MIRROR)),
)
"""Two mirror balls that halve white light, under a white sky."""


def test_every_bounce_halves_the_light_once_more() -> None:
    """A pixel's ray is reflected once, or more often between the balls: its radiance is a power of a half."""
    powers = [0.5**k for k in range(6)]
    image = ldtrefl.render(SCENE, "bvh", max_bounces=5).image[..., 0]
    assert np.abs(image[..., None] - powers).min(axis=-1).max() < 1e-6
    assert (np.abs(image - 0.25) < 1e-6).any() and (np.abs(image - 0.125) < 1e-6).any()


def test_the_scene_says_how_many_bounces_unless_the_option_does() -> None:
    one, three = (ldtrefl.render(SCENE, "bvh", max_bounces=bounces) for bounces in (1, 3))
    assert (one.image != three.image).any()
    given = Scene(
        camera=SCENE.camera,
        environment=SCENE.environment,
        objects=SCENE.objects,
        reflection=Reflection(method="bvh", max_bounces=3),
    )
    np.testing.assert_array_equal(ldtrefl.render(given).image, three.image)
    np.testing.assert_array_equal(ldtrefl.render(given, max_bounces=1).image, one.image)


@pytest.mark.parametrize("bounces", [0, 65, 1.5, True])
def test_numbers_of_bounces_that_are_none_are_refused(bounces: object) -> None:
    with pytest.raises(InputError, match=r"^method bvh: max_bounces: "):
        ldtrefl.Renderer(SCENE, "bvh", max_bounces=bounces)
