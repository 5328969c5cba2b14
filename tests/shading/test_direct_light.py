"""Direct light against its closed form, on turned, stretched and tiny objects."""

import numpy as np
import pytest

from ldtrefl.scene.description import Light, Lighting, Material
from tests.shading.facets import SIZES, TURNS, Facet, turned


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_diffuse_light_follows_the_cosine(turn: tuple, size: object) -> None:
    """``emission + albedo * (ambient + radiance * cos)``, from either side of the plane; nothing from behind."""
    for degrees in (20.0, 70.0):
        facet = Facet(turn, size, 40.0)
        angle = np.radians(degrees)
        matrix = turned(turn)
        towards = np.cos(angle) * matrix[:, 2] + np.sin(angle) * matrix[:, 1]
        white = Material(albedo=(0.5, 0.25, 1.0), emission=(0.1, 0.2, 0.3))
        for side in (1.0, -1.0):
            light = Light(kind="directional", direction=tuple((-side * towards).tolist()), radiance=(2, 3, 4))
            lit = Lighting(ambient=(0.2, 0.3, 0.4))
            arriving = np.array([2, 3, 4]) * np.cos(angle) * (side > 0) + [0.2, 0.3, 0.4]
            expected = np.array([0.5, 0.25, 1.0]) * arriving + [0.1, 0.2, 0.3]
            np.testing.assert_allclose(facet.seen(white, lights=(light,), lighting=lit), expected, rtol=2e-5)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_point_light_falls_off_with_the_square(turn: tuple, size: object) -> None:
    facet = Facet(turn, size, 40.0)
    for degrees in (0.0, 60.0):
        angle = np.radians(degrees)
        offset = np.cos(angle) * facet.normal + np.sin(angle) * turned(turn)[:, 1]
        distance = 0.7 * facet.distance
        position = tuple((distance * offset).tolist())
        light = Light(kind="point", position=position, intensity=(distance**2, 2 * distance**2, 0))
        image = facet.seen(Material(albedo=(1, 1, 1)), lights=(light,))
        np.testing.assert_allclose(image, np.cos(angle) * np.array([1.0, 2.0, 0.0]), rtol=1e-4)
