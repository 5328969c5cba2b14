"""Ray casting: what its rays bring is known in closed form, with as many bounces as are asked for."""

import dataclasses

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Camera, Environment, Material, Object, Reflection, Scene
from tests.frame import flat_mirror

MIRROR = Material(albedo=0.0, mirror=0.5)
SCENE = Scene(
    camera=Camera(eye=(0.0, -6.0, 1.5), look_at=(0.5, 0.0, 0.0), width=60, height=40, fov_y=40),
    environment=Environment(sky=(1.0, 1.0, 1.0), ground=(1.0, 1.0, 1.0)),
    objects=(Object(shape="sphere", material=MIRROR), Object(shape="sphere", translate=(2, -1, 0), material=MIRROR)),
)
"""Two mirror balls that halve white light, under a white sky."""


@pytest.mark.parametrize("bounces", [1, 2])
def test_the_reflection_in_a_flat_mirror(bounces: int) -> None:
    given = flat_mirror.scene(box_mirror=0.5)
    frame, expected = ldtrefl.render(given, "bvh", max_bounces=bounces), flat_mirror.reflection(given, bounces)
    np.testing.assert_allclose(frame.reflection.reshape(-1, 3)[expected.pixels], expected.radiance, rtol=2e-5)
    assert frame.hits is not None
    np.testing.assert_allclose(frame.hits.distance.ravel()[expected.pixels], expected.distance, rtol=1e-5)


def test_the_scene_says_how_many_bounces_unless_the_option_does() -> None:
    given = flat_mirror.scene(box_mirror=0.5)
    once, twice = (ldtrefl.render(given, "bvh", max_bounces=bounces).image for bounces in (1, 2))
    assert (once != twice).any()
    by_scene = dataclasses.replace(given, reflection=Reflection(method="bvh", max_bounces=2))
    np.testing.assert_array_equal(ldtrefl.render(by_scene).image, twice)
    np.testing.assert_array_equal(ldtrefl.render(by_scene, max_bounces=1).image, once)


def test_every_ray_is_asked_about_every_other_object_if_nothing_is_skipped() -> None:
    frame = ldtrefl.render(flat_mirror.scene(), "bvh", skip="none")
    counters = frame.stats.counters
    assert counters["rays"] == counters["reflector_pixels"] == counters["searches"] > 0
    assert counters["searches_saved"] == 0
    np.testing.assert_array_equal(frame.image, ldtrefl.render(flat_mirror.scene(), "bvh").image)


@pytest.mark.parametrize("value", [0, 65, 1.5, "2", True])
def test_bounces_that_are_not_allowed(value: object) -> None:
    with pytest.raises(ldtrefl.InputError, match=r"^method bvh: max_bounces: .*got "):
        ldtrefl.render(flat_mirror.scene(), "bvh", max_bounces=value)


def test_every_bounce_halves_the_light_once_more() -> None:
    """A pixel's ray is reflected once, or more often between the balls: its radiance is a power of a half."""
    powers = [0.5**k for k in range(6)]
    image = ldtrefl.render(SCENE, "bvh", max_bounces=5).image[..., 0]
    assert np.abs(image[..., None] - powers).min(axis=-1).max() < 1e-6
    assert (np.abs(image - 0.25) < 1e-6).any() and (np.abs(image - 0.125) < 1e-6).any()
