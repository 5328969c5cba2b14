"""Fresnel reflectance against Schlick's formula, and reflected directions."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.scene.description import Environment, Material
from ldtrefl.shading.specular import mirror_direction, schlick
from tests.shading.facets import SIZES, TURNS, Facet


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_fresnel_is_schlicks(turn: tuple, size: object) -> None:
    white = Environment(sky=(1, 1, 1), ground=(1, 1, 1))
    for degrees in (0.0, 30.0, 60.0, 80.0):
        mirror = Material(albedo=(0, 0, 0), mirror=(0.04, 0.5, 1.0), fresnel=True)
        base = np.array([0.04, 0.5, 1.0])
        expected = base + (1 - base) * (1 - np.cos(np.radians(degrees))) ** 5
        for method in ("bvh", "ldt"):
            image = Facet(turn, size, degrees).seen(mirror, method, environment=white)
            np.testing.assert_allclose(image, expected, rtol=2e-4)


def test_schlick_goes_from_the_reflectance_to_1() -> None:
    base = wp.vec3(0.04, 0.5, 1.0)
    np.testing.assert_allclose(schlick(base, 1.0), base)
    np.testing.assert_allclose(schlick(base, 0.0), (1.0, 1.0, 1.0))
    np.testing.assert_allclose(schlick(base, -0.5), (1.0, 1.0, 1.0))
    np.testing.assert_allclose(schlick(base, 0.5)[0], 0.04 + 0.96 * 0.5**5, rtol=1e-6)


def test_a_direction_is_reflected_about_either_side_of_the_normal() -> None:
    for normal in (wp.vec3(0.0, 0.6, 0.8), wp.vec3(0.0, -0.6, -0.8)):
        np.testing.assert_allclose(mirror_direction(wp.vec3(0.0, 0.0, -1.0), normal), (0.0, 0.96, 0.28), atol=1e-6)
        np.testing.assert_allclose(mirror_direction(wp.vec3(1.0, 0.0, 0.0), normal), (1.0, 0.0, 0.0), atol=1e-6)
