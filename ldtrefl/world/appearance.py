"""Colours and textures of a mesh's parts on a device."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.world.mip_maps import mip_maps
from ldtrefl.world.texture_pool import joined_texels


@dataclass(frozen=True, eq=False)
class Appearance:
    """Colours and textures of a mesh's parts; the fields of ``ObjectRecord`` with the same names say what they hold."""

    part_first: wp.array
    part_color: wp.array
    part_texture: wp.array
    texels: wp.array
    texel_bytes: wp.array
    part_mips: wp.array
    mip_texels: wp.array
    mip_bytes: wp.array

    @property
    def has_textures(self) -> bool:
        """Whether any part has a texture."""
        return bool(self.texels.shape[0] + self.texel_bytes.shape[0] > 0)


def appearance_of(
    mesh: Mesh, texture: StoredPicture | None, device: wp.Device, *, has_look: bool = False, filters: bool = False
) -> Appearance:
    """Upload the colours and textures of a mesh's parts; a texture of several parts is uploaded once.

    ``texture`` takes the place of all parts' own textures if it is given. With ``has_look`` there are no textures: an
    object's look has them. Textures that ``filters`` asks for have their mip maps beside them.

    Raises:
        InputError: there is a texture, and the mesh has no texture coordinates; or the textures have too many texels.
    """
    textures = [None if has_look else _base_picture(part) if texture is None else texture for part in mesh.parts]
    pools: dict[type, list[np.ndarray]] = {np.float32: [], np.uint8: []}
    mips: dict[type, list[np.ndarray]] = {np.float32: [], np.uint8: []}
    places: dict[str, tuple[int, int, int, int]] = {}
    mip_places: dict[str, int] = {}
    for picture in textures:
        if picture is not None and picture.key not in places:
            pixels = picture.pixels
            kind = np.uint8 if pixels.dtype == np.uint8 else np.float32
            first = sum(len(pool) for pool in pools[kind])
            places[picture.key] = (first, pixels.shape[1], pixels.shape[0], int(kind is np.uint8))
            pools[kind].append(np.ascontiguousarray(pixels, kind).reshape(-1, 3))
            mip_places[picture.key] = sum(len(pool) for pool in mips[kind])
            if filters:
                mips[kind].append(mip_maps(pixels))
    if places and mesh.uvs is None:
        raise InputError("material.texture: the object has no texture coordinates (UVs)")
    table = [(0, 0, 0, 0) if picture is None else places[picture.key] for picture in textures]
    mip_table = [0 if picture is None else mip_places[picture.key] for picture in textures]
    return Appearance(
        wp.array([p.first_triangle for p in mesh.parts], dtype=wp.int32, device=device),
        wp.array([p.material.base_color for p in mesh.parts], dtype=wp.vec3, device=device),
        wp.array(table, dtype=wp.vec4i, device=device),
        joined_texels(pools[np.float32], wp.vec3, device),
        joined_texels(pools[np.uint8], wp.vec3ub, device),
        wp.array(mip_table if filters else [], dtype=wp.int32, device=device),
        joined_texels(mips[np.float32], wp.vec3, device),
        joined_texels(mips[np.uint8], wp.vec3ub, device),
    )


def _base_picture(part: Part) -> StoredPicture | None:
    """The picture of a part's base colour; None without one."""
    texture = part.material.base_texture
    return None if texture is None else texture.picture
