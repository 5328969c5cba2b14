"""The materials of a file, as ``ldtrefl info`` says them, by the names that ``parts`` of a scene file takes."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator

import numpy as np
from rich.table import Table

from ldtrefl.base.errors import printable
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture

MOST_ROWS = 40
"""Rows of a table that are shown."""


def material_listing(materials: Iterable[SurfaceMaterial], count: int) -> Iterator[str | Table]:
    """A line and a table about materials, of which the first are asked for; nothing if there are none."""
    if not count:
        return
    table = Table("material", "base colour", "metallic", "roughness", "alpha", "sides", "textures")
    for number, made in enumerate(itertools.islice(materials, MOST_ROWS)):
        row = (printable(made.name or str(number)), numbers_in_words(made.base_color), f"{made.metallic:.3g}")
        sides = "both" if made.double_sided else "front"
        table.add_row(*row, f"{made.roughness:.3g}", made.alpha_mode, sides, ", ".join(_textures(made)) or "none")
    yield f"{count} materials"
    yield table
    if count > MOST_ROWS:
        yield f"... and {count - MOST_ROWS} more"


def numbers_in_words(values: object) -> str:
    """Numbers to four digits, between blanks."""
    return " ".join(f"{value:.4g}" for value in np.asarray(values).tolist())


def _textures(material: SurfaceMaterial) -> list[str]:
    """What textures a material has, and how large."""
    found = []
    for name, value in vars(material).items():
        if isinstance(value, Texture):
            height, width = value.picture.pixels.shape[:2]
            found.append(f"{name.removesuffix('_texture').replace('_', ' ')} {width} x {height}")
    return found
