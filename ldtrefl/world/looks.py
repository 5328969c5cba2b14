"""Looks of objects on a device: which objects have one, and how what the scene says of an object goes with its file.

A key that ``[object.material]`` gives overrides the file's for all parts; one that it does not give leaves the file's.
``albedo`` is times the file's base colour. Where it is not given it counts as 1 for materials of a file, and as 0.8 for
things without any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.scene.material import Material, is_given
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial, Texture
from ldtrefl.world import look_records
from ldtrefl.world.look_records import LookRecord, MaterialRecord, SlotNumbers
from ldtrefl.world.texture_pool import TexturePool

MODES = {"opaque": look_records.OPAQUE, "mask": look_records.MASK, "blend": look_records.BLEND}

SLOT_FIELDS = {
    "base_texture": look_records.BASE,
    "normal_texture": look_records.NORMAL,
    "occlusion_texture": look_records.OCCLUSION,
    "emission_texture": look_records.EMISSION,
}
"""Textures of a material, and their slots."""

ONLY_COLORS = ("name", "base_color", "base_texture", "double_sided", "alpha", "alpha_cutoff", "ior")
"""Fields that say nothing more of a matt, opaque material than ``ObjectRecord`` does."""


def has_material(mesh: Mesh) -> bool:
    """Whether a mesh's file says anything of its colours."""
    return mesh.colors is not None or any(part.material.name or part.material.key != PLAIN.key for part in mesh.parts)


def mesh_needs_look(mesh: Mesh) -> bool:
    """Whether a mesh's file says more of its surface than colours and plain pictures."""
    return mesh.colors is not None or any(_needs_look(part.material) for part in mesh.parts)


def _needs_look(material: SurfaceMaterial) -> bool:
    texture = material.base_texture
    if texture is not None and _is_laid_out(texture):
        return True
    as_plain = {name: getattr(material, name) for name in ONLY_COLORS}
    return material.key != replace(PLAIN, **as_plain).key


def _is_laid_out(texture: Texture) -> bool:
    """Whether a texture is more than a picture that repeats."""
    return texture.key != Texture(texture.picture).key


def look_of(
    mesh: Mesh,
    own: Material,
    arrays: dict[str, wp.array],
    device: wp.Device,
) -> LookRecord:
    """The look of an object.

    Args:
        mesh: its mesh.
        own: what the scene says of it.
        arrays: those of the mesh's vertices, by the names of the fields.
        device: where it is read.

    Raises:
        InputError: the scene gives a texture, and the mesh has no texture coordinates.
    """
    if own.texture is not None and mesh.uvs is None:
        raise InputError("material.texture: the object has no texture coordinates (UVs)")
    look, pool, is_of_file = LookRecord(), TexturePool(), has_material(mesh)
    looks = [overridden(part.material, own, is_of_file=is_of_file) for part in mesh.parts]
    uv_sets = [mesh.uvs is not None, mesh.second_uvs is not None]
    records = [_material_record(material, pool, uv_sets) for material in looks]
    look.materials = wp.array(records, dtype=MaterialRecord, device=device)
    pool.upload(look, device)
    for name, array in arrays.items():
        setattr(look, name, array)
    return look


def overridden(material: SurfaceMaterial, own: Material, *, is_of_file: bool) -> SurfaceMaterial:
    """A file's material with what the scene says of the object."""
    changes: dict[str, Any] = {}
    red, green, blue = own.albedo if is_given(own.albedo) or any(own.mirror) or not is_of_file else (1.0, 1.0, 1.0)
    of_red, of_green, of_blue = material.base_color
    changes["base_color"] = (red * of_red, green * of_green, blue * of_blue)
    if own.picture is not None:
        changes["base_texture"] = Texture(own.picture)
    if is_given(own.emission):
        changes["emission"], changes["emission_texture"] = own.emission, None
    return replace(material, **changes)


def _material_record(material: SurfaceMaterial, pool: TexturePool, uv_sets: Sequence[bool]) -> MaterialRecord:
    """A material as kernels read it; a texture without its texture coordinates is left out."""
    record = MaterialRecord()
    record.base, record.alpha = wp.vec3(*material.base_color), material.alpha
    record.alpha_mode, record.alpha_cutoff = MODES[material.alpha_mode], material.alpha_cutoff
    record.emission, record.is_unlit = wp.vec3(*material.emission), int(material.is_unlit)
    record.normal_scale, record.occlusion_strength = material.normal_scale, material.occlusion_strength
    numbers = [-1] * int(look_records.SLOTS)
    for name, slot in SLOT_FIELDS.items():
        texture = getattr(material, name)
        if texture is not None and texture.uv_set < len(uv_sets) and uv_sets[texture.uv_set]:
            numbers[slot] = pool.number_of(texture)
    record.textures = SlotNumbers(*numbers)
    record.slots = max((slot + 1 for slot, number in enumerate(numbers) if number >= 0), default=0)
    return record
