"""The environment as a mirror shows it, against its closed form."""

import numpy as np
import pytest

from ldtrefl.scene.description import Environment, Material
from tests.shading.facets import SIZES, TURNS, Facet


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_mirror_sees_the_environment_along_the_reflected_direction(turn: tuple, size: object) -> None:
    """``mirror * (blend of sky and ground)`` by the height of ``2 (n . v) n - v`` over the camera's up."""
    facet = Facet(turn, size, 50.0)
    mirror = Material(albedo=(0, 0, 0), mirror=(0.9, 0.5, 0.1))
    two = Environment(sky=(1, 0, 2), ground=(0, 1, 2))
    onwards = 2 * (facet.normal @ facet.to_eye) * facet.normal - facet.to_eye
    blend = 0.5 + 0.5 * onwards @ np.array(facet.camera.up)
    expected = np.array([0.9, 0.5, 0.1]) * [blend, 1 - blend, 2.0]
    for method in ("bvh", "ldt"):
        np.testing.assert_allclose(facet.seen(mirror, method, environment=two), expected, rtol=2e-5)
