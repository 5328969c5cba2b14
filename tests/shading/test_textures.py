"""Textures against bilinear interpolation by hand."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.description import Lighting, Material
from tests.shading.facets import SIZES, TURNS, Facet


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_textures_are_bilinear_between_texel_centres(tmp_path: Path, turn: tuple, size: object) -> None:
    """A row of texels 0, 1, 0, 0 on a plane: the middle lies half-way between the second and the third."""
    picture = np.zeros((1, 4, 3), np.float32)
    picture[0, 1] = [1.0, 0.5, 0.25]
    ldtrefl.save_image(tmp_path / "row.exr", picture)
    material = Material(albedo=(1, 1, 0.5), texture=str(tmp_path / "row.exr"))
    image = Facet(turn, size, 20.0, up_the=1).seen(material, lighting=Lighting(ambient=(1, 1, 1)))
    np.testing.assert_allclose(image, [0.5, 0.25, 0.0625], rtol=1e-6)  # the camera looks at the middle itself
