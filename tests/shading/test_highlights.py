"""Lights in rough surfaces, against the formulas of glTF's appendix B in float64."""

from __future__ import annotations

import numpy as np
import pytest

from ldtrefl.scene.description import Light, Lighting, Material
from ldtrefl.shading.finish import LEAST_ROUGHNESS
from ldtrefl.world.reflectance_table import COLUMNS, ROWS, reflectance_table
from tests.shading.facets import Facet, turned

DARK = Lighting(ambient=(0, 0, 0))


def shares(cosine: float, roughness: float) -> np.ndarray:
    """The table's two shares, bilinear as it is read, but for the smooth surface's closed form."""
    table = reflectance_table().reshape(ROWS, COLUMNS, 3)[..., :2].astype(float)
    x, y = np.sqrt(cosine) * (COLUMNS - 1), roughness * (ROWS - 1)
    column, row = min(int(x), COLUMNS - 2), min(int(y), ROWS - 2)
    right, down = x - column, y - row
    upper = (1 - right) * table[row, column] + right * table[row, column + 1]
    if row == 0:
        upper = np.array([1.0 - (1.0 - cosine) ** 5, (1.0 - cosine) ** 5])
    lower = (1 - right) * table[row + 1, column] + right * table[row + 1, column + 1]
    return (1 - down) * upper + down * lower


def expected(
    base: np.ndarray, metallic: float, roughness: float, ior: float, angles: tuple[float, float]
) -> np.ndarray:
    """What a light in the plane of the normal and the viewer, on the other side, gives a surface of glTF's model, with
    what microfacets reflect more than once added."""
    to_eye, to_light = np.radians(angles)
    view, light = np.array([np.sin(to_eye), np.cos(to_eye)]), np.array([-np.sin(to_light), np.cos(to_light)])
    half = (view + light) / np.linalg.norm(view + light)
    alpha = max(roughness, LEAST_ROUGHNESS) ** 2
    density = alpha**2 / (np.pi * (half[1] ** 2 * (alpha**2 - 1.0) + 1.0) ** 2)
    masked = light[1] * np.sqrt(view[1] ** 2 * (1 - alpha**2) + alpha**2)
    masked += view[1] * np.sqrt(light[1] ** 2 * (1 - alpha**2) + alpha**2)
    once, grazing = density * 0.5 / masked, (1.0 - view @ half) ** 5
    a, b = shares(view[1], roughness)
    dielectric = np.full(3, ((ior - 1.0) / (ior + 1.0)) ** 2)
    total = 0.0
    for share, low in ((1.0 - metallic, dielectric), (metallic, base)):
        again = 1.0 + low * (1.0 / (a + b) - 1.0)
        total = total + share * again * once * (low + (1.0 - low) * grazing)
    scattered = 1.0 - ((1.0 + dielectric * (1.0 / (a + b) - 1.0)) * (dielectric * a + b)).max()
    # Radiance is of a white diffuse surface, which scatters 1 / pi of what arrives.
    return light[1] * ((1.0 - metallic) * scattered * base + np.pi * total)


@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("ior", [1.33, 2.4])
@pytest.mark.parametrize("angles", [(30.0, 30.0), (20.0, 65.0), (75.0, 70.0)])
def test_metals_and_dielectrics(metallic: float, roughness: float, ior: float, angles: tuple[float, float]) -> None:
    turn = (1, -2, 3, 77)
    facet, matrix, to_light = Facet(turn, 1.0, angles[0]), turned(turn), np.radians(angles[1])
    towards = np.cos(to_light) * matrix[:, 2] - np.sin(to_light) * matrix[:, 0]
    light = Light(kind="directional", direction=tuple((-towards).tolist()), radiance=(2.0, 2.0, 2.0))
    base = np.array([0.9, 0.5, 0.1])
    material = Material(albedo=tuple(base), metallic=metallic, roughness=roughness, ior=ior)
    image = facet.seen(material, lights=(light,), lighting=DARK)
    np.testing.assert_allclose(image, 2.0 * expected(base, metallic, roughness, ior, angles), rtol=2e-3)


def test_a_sharp_mirror_of_the_scene_mirrors_no_lights_and_a_rough_one_does() -> None:
    light = Light(kind="directional", direction=(0, 0, -1), radiance=(1.0, 1.0, 1.0))
    facet = Facet((0, 0, 1, 0), 1.0, 0.0)
    assert (facet.seen(Material(mirror=1.0), lights=(light,), lighting=DARK) == 0.0).all()
    rough = facet.seen(Material(mirror=1.0, roughness=0.5), lights=(light,), lighting=DARK)
    alpha = 0.25
    a, b = shares(1.0, 0.5)
    np.testing.assert_allclose(rough, 0.25 / alpha**2 / (a + b), rtol=2e-3)  # D V pi with all cosines 1
