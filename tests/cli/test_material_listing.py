"""Materials in words: their names, numbers and textures."""

import io
import re

import numpy as np
from rich.console import Console

from ldtrefl.cli.material_listing import MOST_ROWS, material_listing
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial, Texture


def said(materials: list[SurfaceMaterial]) -> str:
    """The listing as text, with one blank between words."""
    console = Console(file=io.StringIO(), width=200)
    for part in material_listing(materials, len(materials)):
        console.print(part)
    assert isinstance(console.file, io.StringIO)
    return re.sub(r"[\s│]+", " ", console.file.getvalue())


def test_numbers_and_textures_are_named() -> None:
    texture = Texture(StoredPicture(np.zeros((2, 3, 3), np.uint8)))
    wood = SurfaceMaterial(name="wood\n", base_color=(0.1, 0.25, 1.0), roughness=0.5, emission_texture=texture)
    text = said([wood, PLAIN])
    assert text.startswith("2 materials ") and "wood\\n 0.1 0.25 1 0 0.5 opaque both emission 3 x 2" in text
    assert " 1 1 1 1 0 1 opaque both none" in text and said([]) == ""


def test_many_are_cut_short() -> None:
    text = said([PLAIN] * (MOST_ROWS + 3))
    assert f"{MOST_ROWS + 3} materials" in text and "... and 3 more" in text
