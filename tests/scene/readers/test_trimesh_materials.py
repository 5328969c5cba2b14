"""trimesh's materials as ours: base colour and picture, if there are texture coordinates for it."""

from types import SimpleNamespace

import numpy as np
from PIL import Image

from ldtrefl.scene.piece import Piece
from ldtrefl.scene.readers.trimesh_materials import surface_material_of, with_materials
from ldtrefl.scene.surface_material import PLAIN


def test_a_material_of_trimesh() -> None:
    picture = Image.new("RGB", (2, 2), (1, 2, 3))
    given = SimpleNamespace(name="a", baseColorFactor=np.array([255, 0, 51, 255], np.uint8), baseColorTexture=picture)
    made = surface_material_of(given)
    assert made.name == "a" and made.base_color == (1.0, 0.0, 0.2)
    assert made.base_texture is not None and (made.base_texture.picture.pixels == [1, 2, 3]).all()
    assert surface_material_of(None) is PLAIN
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])
    with_uvs, without = with_materials(
        [
            (Piece(vertices, faces, None, np.zeros((3, 2), np.float32)), given),
            (Piece(vertices, faces, None, None), given),
        ]
    )
    assert with_uvs.material.base_texture is not None and without.material.base_texture is None
