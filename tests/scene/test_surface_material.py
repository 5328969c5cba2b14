"""Materials are known by what they hold."""

import dataclasses

import numpy as np

from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial, Texture


def test_materials_are_known_by_all_that_they_hold_but_their_names() -> None:
    texture, alike = (Texture(StoredPicture(np.zeros((1, 1, 3), np.uint8))) for _ in range(2))
    base = SurfaceMaterial(base_texture=texture)
    assert base.key == SurfaceMaterial(name="wood", base_texture=alike).key
    assert base.textures == [texture] and PLAIN.textures == []
    others = [
        PLAIN,
        SurfaceMaterial(emission_texture=texture),
        dataclasses.replace(base, metallic=0.5),
        dataclasses.replace(base, alpha_mode="mask"),
        dataclasses.replace(base, base_texture=dataclasses.replace(texture, wrap=("clamp", "repeat"))),
        dataclasses.replace(base, base_texture=dataclasses.replace(texture, is_data=True)),
    ]
    assert len({base.key, *(other.key for other in others)}) == 1 + len(others)
