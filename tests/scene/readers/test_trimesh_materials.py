"""trimesh's materials: base colours, linear, and pictures where there are coordinates for them."""

import numpy as np
from PIL import Image
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from ldtrefl.scene.piece import Piece
from ldtrefl.scene.readers.trimesh_materials import surface_material_of, with_materials
from ldtrefl.scene.surface_material import PLAIN


def test_base_colours_are_fractions() -> None:
    assert surface_material_of(None) is PLAIN
    floats = surface_material_of(PBRMaterial(name="paint", baseColorFactor=np.array([0.5, 0.25, 1.0, 1.0])))
    assert floats.base_color == (0.5, 0.25, 1.0) or np.allclose(floats.base_color, (0.5, 0.25, 1.0), atol=1 / 255)
    assert floats.name == "paint" and floats.base_texture is None


def test_a_picture_needs_coordinates() -> None:
    picture = Image.fromarray(np.full((2, 2, 3), 7, np.uint8))
    material = SimpleMaterial(image=picture)
    corners, faces = np.eye(3), np.array([[0, 1, 2]])
    with_uvs = Piece(corners, faces, None, np.zeros((3, 2), np.float32))
    textured, plain = with_materials([(with_uvs, material), (Piece(corners, faces, None, None), material)])
    assert textured.material.base_texture is not None and plain.material.base_texture is None
    assert textured.material.base_texture.picture.pixels[0, 0].tolist() == [7, 7, 7]
