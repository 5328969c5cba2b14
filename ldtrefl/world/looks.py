"""Looks of objects on a device: which objects have one, and how what the scene says of an object goes with its file.

A key that ``[object.material]`` gives overrides the file's for all parts; one that it does not give leaves the file's.
``albedo`` is times the file's base colour. Where it is not given it counts as 1 for materials of a file, and as 0.8 for
things without any. ``mirror`` takes the place of all that the file says of reflection; ``metallic``, ``roughness`` and
``ior`` make of a matt material one of glTF's model, as smooth as can be if nothing says how rough it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.files.srgb import srgb_from_linear
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.description import Object, Reflection
from ldtrefl.scene.material import Material, is_given
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial, Texture
from ldtrefl.world import look_records
from ldtrefl.world.hidden_backs import hides_backs, is_double_sided
from ldtrefl.world.look_records import LookRecord, MaterialRecord, SlotNumbers
from ldtrefl.world.texture_pool import TexturePool

MODES = {"opaque": look_records.OPAQUE, "mask": look_records.MASK, "blend": look_records.BLEND}

SLOT_FIELDS = {
    "base_texture": look_records.BASE,
    "metallic_roughness_texture": look_records.METALLIC_ROUGHNESS,
    "normal_texture": look_records.NORMAL,
    "occlusion_texture": look_records.OCCLUSION,
    "emission_texture": look_records.EMISSION,
    "specular_texture": look_records.SPECULAR,
    "specular_color_texture": look_records.SPECULAR_COLOR,
    "clearcoat_texture": look_records.CLEARCOAT,
    "clearcoat_roughness_texture": look_records.CLEARCOAT_ROUGHNESS,
}
"""Textures of a material, and their slots."""

ONLY_COLORS = ("name", "base_color", "base_texture", "double_sided", "alpha", "alpha_cutoff", "ior", "roughness")
"""Fields that say nothing more of a matt, opaque material than ``ObjectRecord`` does."""


def has_material(mesh: Mesh) -> bool:
    """Whether a mesh's file says anything of its colours."""
    return mesh.colors is not None or any(map(_has_colors, mesh.parts))


def _has_colors(part: Part) -> bool:
    return bool(part.material.name) or replace(part.material, double_sided=True).key != PLAIN.key


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


@dataclass(frozen=True, eq=False)
class Look:
    """What an object looks like, on a device."""

    record: LookRecord
    reflects: bool
    """Whether rays may be sent from some part of it, mirrored or straight on."""
    lets_through: bool
    """Whether some part lets light through by its alpha."""
    shines: bool
    """Whether some part reflects anything at all."""
    has_textures: bool
    """Whether any part has a texture."""


def look_of(
    mesh: Mesh,
    owns: Sequence[Material],
    reflection: Reflection,
    arrays: dict[str, wp.array],
    device: wp.Device,
    *,
    filters: bool = False,
) -> Look:
    """The look of an object.

    Args:
        mesh: its mesh.
        owns: what the scene says of each of the mesh's parts.
        reflection: from when on rays are sent.
        arrays: those of the mesh, by the names of the fields.
        device: where it is read.
        filters: textures have their mip maps.

    Raises:
        InputError: the scene gives a texture, and the mesh has no texture coordinates.
    """
    if any(own.texture is not None for own in owns) and mesh.uvs is None:
        raise InputError("material.texture: the object has no texture coordinates (UVs)")
    look, pool, is_of_file = LookRecord(), TexturePool(filters=filters), has_material(mesh)
    pairs = zip(mesh.parts, owns, strict=True)
    looks = [overridden(part.material, own, is_of_file=is_of_file) for part, own in pairs]
    uv_sets = [mesh.uvs is not None, mesh.second_uvs is not None]
    told = zip(looks, owns, strict=True)
    records = [_material_record(material, own, reflection, pool, uv_sets) for material, own in told]
    if hides_backs(mesh, owns):
        for record, material in zip(records, looks, strict=True):
            record.hides_back = int(not material.double_sided)
    look.materials = wp.array(records, dtype=MaterialRecord, device=device)
    pool.upload(look, device)
    for name, array in arrays.items():
        setattr(look, name, array)
    shines = any(record.has_mirror or material.reflects for record, material in zip(records, looks, strict=True))
    lets_through = any(material.alpha_mode != "opaque" for material in looks)
    look.lets_through = int(lets_through)
    reflects = any(record.reflects or record.hides_back for record in records)
    return Look(look, reflects, lets_through, shines, look.textures.shape[0] > 0)


def is_mirror(entry: Object, reflection: Reflection) -> bool:
    """Whether rays may be mirrored at some part of an object: the scene makes it a mirror, or its file."""
    is_of_file = has_material(entry.geometry)
    for part in entry.geometry.parts:
        own = entry.material_of(part.material.name)
        material = overridden(part.material, own, is_of_file=is_of_file)
        if not material.is_unlit and _may_send_rays(material, own, reflection):
            return True
    return False


def overridden(material: SurfaceMaterial, own: Material, *, is_of_file: bool) -> SurfaceMaterial:
    """A file's material with what the scene says of the object."""
    changes: dict[str, Any] = {"double_sided": is_double_sided(material, own)}
    red, green, blue = own.albedo if is_given(own.albedo) or any(own.mirror) or not is_of_file else (1.0, 1.0, 1.0)
    of_red, of_green, of_blue = material.base_color
    changes["base_color"] = (red * of_red, green * of_green, blue * of_blue)
    if own.picture is not None:
        changes["base_texture"] = Texture(own.picture)
    if is_given(own.emission) or material.is_unlit:  # what is unlit shows its base colour, and no emission of the file
        changes["emission"], changes["emission_texture"] = own.emission, None
    if own.has_model or any(own.mirror):
        changes["is_unlit"] = False
    if own.metallic is not None:
        changes["metallic"] = own.metallic
    if own.ior is not None:
        changes["ior"] = own.ior
    if own.metallic is not None or own.roughness is not None or any(own.mirror):
        changes["metallic_roughness_texture"] = _kept_texture(material, own)
    if own.roughness is not None:
        changes["roughness"] = own.roughness
    elif any(own.mirror) or (own.has_model and not material.reflects):
        changes["roughness"] = 0.0
    if own.has_model and not material.reflects:
        changes["specular"] = 1.0
    return replace(material, **changes)


def _kept_texture(material: SurfaceMaterial, own: Material) -> Texture | None:
    """The texture of roughness and metallic without what is given in its place."""
    texture = material.metallic_roughness_texture
    rough_is_given, metal_is_given = own.roughness is not None or any(own.mirror), own.metallic is not None
    if texture is None or (rough_is_given and metal_is_given):
        return None
    pixels = np.array(texture.picture.pixels)
    white = 255 if pixels.dtype == np.uint8 else 1.0
    if rough_is_given:
        pixels[..., 1] = white
    if metal_is_given:
        pixels[..., 2] = white
    return replace(texture, picture=StoredPicture(pixels))


def _material_record(
    material: SurfaceMaterial, own: Material, reflection: Reflection, pool: TexturePool, uv_sets: Sequence[bool]
) -> MaterialRecord:
    """A material as kernels read it; a texture without its texture coordinates is left out."""
    record = MaterialRecord()
    _set_model(record, material, own)
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
    may_mirror = not material.is_unlit and _may_send_rays(material, own, reflection)
    record.reflects = int(may_mirror or material.alpha_mode != "opaque")
    record.slots = max((slot + 1 for slot, number in enumerate(numbers) if number >= 0), default=0)
    return record


def _set_model(record: MaterialRecord, material: SurfaceMaterial, own: Material) -> None:
    """Set how a surface reflects."""
    record.metallic, record.roughness = material.metallic, material.roughness
    record.dielectric = 1.0 if material.ior == 0.0 else ((material.ior - 1.0) / (material.ior + 1.0)) ** 2
    record.specular, record.specular_color = material.specular, wp.vec3(*material.specular_color)
    record.clearcoat, record.clearcoat_roughness = material.clearcoat, material.clearcoat_roughness
    record.mirror, record.has_mirror = wp.vec3(*own.mirror), int(any(own.mirror))
    record.has_fresnel = int(own.fresnel)
    # A sharp mirror of the scene mirrors no lights, with a look or without.
    record.has_highlights = int(not any(own.mirror) or own.roughness is not None)


def _may_send_rays(material: SurfaceMaterial, own: Material, reflection: Reflection) -> bool:
    """Whether some place of a material may reflect enough, and sharply enough, for a ray. Along the surface it reflects
    as much as it ever does."""
    least_rough = material.roughness * _extremes(material.metallic_roughness_texture, 1)[0]
    most = 1.0 if any(own.mirror) else material.metallic * _extremes(material.metallic_roughness_texture, 2)[1]
    most = max(most, material.specular * _most_alpha(material.specular_texture))
    sends = most > 0.0 and most >= reflection.threshold and least_rough <= reflection.rough_limit
    coat = material.clearcoat * _extremes(material.clearcoat_texture, 0)[1]
    coat_rough = material.clearcoat_roughness * _extremes(material.clearcoat_roughness_texture, 1)[0]
    coat_sends = coat > 0.0 and coat >= reflection.threshold and coat_rough <= reflection.rough_limit
    return sends or coat_sends


def _extremes(texture: Texture | None, channel: int) -> tuple[float, float]:
    """The least and the largest fraction in a channel of a texture of data; 1 without one."""
    if texture is None:
        return 1.0, 1.0
    pixels = texture.picture.pixels[..., channel]
    ends = np.array([pixels.min(), pixels.max()])
    low, high = ends / 255.0 if pixels.dtype == np.uint8 else srgb_from_linear(ends)
    return float(low), float(high)


def _most_alpha(texture: Texture | None) -> float:
    """The largest alpha of a texture; 1 without any."""
    return 1.0 if texture is None or texture.picture.alpha is None else float(texture.picture.alpha.max()) / 255.0
