"""trimesh's materials -> materials of parts. Their pictures are unpacked once the memory has been asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ldtrefl.files.mesh_textures import stored_texture, take_memory_for_textures, texture_of
from ldtrefl.scene.piece import Piece
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial, Texture


def with_materials(pieces: list[tuple[Piece, object | None]]) -> list[Piece]:
    """Pieces with their materials, given trimesh's.

    Raises:
        InputError: a texture is damaged, or larger than is allowed.
    """
    # By identity: trimesh compares materials by hashes of their unpacked pictures.
    materials = {id(material): material for _, material in pieces}
    take_memory_for_textures(materials.values())
    looks = {number: surface_material_of(material) for number, material in materials.items()}
    return [_with_material(piece, looks[id(material)]) for piece, material in pieces]


def _with_material(piece: Piece, look: SurfaceMaterial) -> Piece:
    return replace(piece, material=look if piece.uvs is not None else replace(look, base_texture=None))


def surface_material_of(material: object | None) -> SurfaceMaterial:
    """One of trimesh's materials: its base colour and texture. Factors are linear and textures sRGB, as in glTF."""
    if material is None:
        return PLAIN
    factor = getattr(material, "baseColorFactor", None)
    color = (1.0, 1.0, 1.0)
    if factor is not None:
        scale = 255.0 if np.asarray(factor).dtype.kind in "iu" else 1.0
        r, g, b = (float(channel) / scale for channel in np.asarray(factor)[:3])
        color = (r, g, b)
    picture = texture_of(material)
    texture = None if picture is None else Texture(stored_texture(picture))
    return SurfaceMaterial(name=str(getattr(material, "name", None) or ""), base_color=color, base_texture=texture)
