"""Materials and their textures (glTF 2.0, 3.8 and 3.9), with the extensions that ``extensions.py`` lists."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.files.mesh_textures import unpacked_picture
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.gltf.container import Document, Table
from ldtrefl.scene.surface_material import IDENTITY, PLAIN, SurfaceMaterial, Texture, Wrap

NEAREST = 9728
"""The filter that takes the nearest texel."""

WRAPS: dict[int, Wrap] = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
IMAGE_SOURCES = ("EXT_texture_webp",)
"""Extensions of textures that name another picture, which is taken."""


UNSAID = replace(PLAIN, double_sided=False)
"""Of primitives without a material: white plaster, as viewers show it, seen from the front (3.9 and 3.7.2.1)."""


@dataclass(eq=False)
class Materials:
    """The materials of an asset, each made when it is first asked for."""

    document: Document
    faults: list[str] = field(default_factory=list)
    """What could not be read, a line each."""
    _made: dict[int, SurfaceMaterial] = field(default_factory=dict)
    _pictures: dict[tuple[int, bool], StoredPicture | None] = field(default_factory=dict)

    def material(self, number: int | None) -> SurfaceMaterial:
        """A material by its number; None for that of primitives without one.

        Raises:
            InputError: it is not sound, or a picture of it is larger than is allowed.
        """
        if number is None:
            return UNSAID
        if number not in self._made:
            self._made[number] = self._read(self.document.entries("materials")[number], f"materials[{number}]")
        return self._made[number]

    def _read(self, entry: Table, where: str) -> SurfaceMaterial:
        document = self.document
        pbr = document.table(entry.get("pbrMetallicRoughness"), f"{where}.pbrMetallicRoughness")
        place = f"{where}.pbrMetallicRoughness"
        red, green, blue, alpha = document.numbers(pbr, "baseColorFactor", place, (1.0, 1.0, 1.0, 1.0))
        mode = entry.get("alphaMode", "OPAQUE")
        if mode not in ("OPAQUE", "MASK", "BLEND"):
            raise InputError(f"{where}.alphaMode: allowed are OPAQUE, MASK, BLEND, got {mode!r:.40}")
        normal, occlusion = (
            document.table(entry.get(k), f"{where}.{k}") for k in ("normalTexture", "occlusionTexture")
        )
        coat = document.extension(entry, "KHR_materials_clearcoat", where)
        gloss = document.extension(entry, "KHR_materials_specular", where)
        bent = document.extension(entry, "KHR_materials_ior", where) or {}
        glow = document.extension(entry, "KHR_materials_emissive_strength", where) or {}
        strength = document.number(glow, "emissiveStrength", where, 1.0)
        emission = document.numbers(entry, "emissiveFactor", where, (0.0, 0.0, 0.0))
        alpha_mode = mode.lower()
        return SurfaceMaterial(
            name=document.name(entry),
            base_color=_not_negative((red, green, blue)),
            base_texture=self._texture(pbr, "baseColorTexture", place, with_alpha=alpha_mode != "opaque"),
            alpha=_fraction(alpha),
            alpha_mode=alpha_mode,
            alpha_cutoff=document.number(entry, "alphaCutoff", where, 0.5),
            metallic=_fraction(document.number(pbr, "metallicFactor", place, 1.0)),
            roughness=_fraction(document.number(pbr, "roughnessFactor", place, 1.0)),
            metallic_roughness_texture=self._texture(pbr, "metallicRoughnessTexture", place, is_data=True),
            normal_texture=self._texture(entry, "normalTexture", where, is_data=True),
            normal_scale=document.number(normal, "scale", f"{where}.normalTexture", 1.0),
            occlusion_texture=self._texture(entry, "occlusionTexture", where, is_data=True),
            occlusion_strength=_fraction(document.number(occlusion, "strength", f"{where}.occlusionTexture", 1.0)),
            emission=_not_negative((strength * emission[0], strength * emission[1], strength * emission[2])),
            emission_texture=self._texture(entry, "emissiveTexture", where),
            double_sided=entry.get("doubleSided") is True,
            ior=max(document.number(bent, "ior", where, 1.5), 0.0),
            is_unlit=document.extension(entry, "KHR_materials_unlit", where) is not None,
            **self._specular(gloss, f"{where}.extensions.KHR_materials_specular"),
            **self._clearcoat(coat, f"{where}.extensions.KHR_materials_clearcoat"),
        )

    def _specular(self, table: Table | None, place: str) -> Table:
        if table is None:
            return {"specular": 1.0}
        color = self.document.numbers(table, "specularColorFactor", place, (1.0, 1.0, 1.0))
        return {
            "specular": _fraction(self.document.number(table, "specularFactor", place, 1.0)),
            "specular_color": _not_negative((color[0], color[1], color[2])),
            "specular_texture": self._texture(table, "specularTexture", place, is_data=True, with_alpha=True),
            "specular_color_texture": self._texture(table, "specularColorTexture", place),
        }

    def _clearcoat(self, table: Table | None, place: str) -> Table:
        if table is None:
            return {}
        number = self.document.number
        return {
            "clearcoat": _fraction(number(table, "clearcoatFactor", place, 0.0)),
            "clearcoat_texture": self._texture(table, "clearcoatTexture", place, is_data=True),
            "clearcoat_roughness": _fraction(number(table, "clearcoatRoughnessFactor", place, 0.0)),
            "clearcoat_roughness_texture": self._texture(table, "clearcoatRoughnessTexture", place, is_data=True),
        }

    def _texture(
        self, table: Table, key: str, place: str, *, is_data: bool = False, with_alpha: bool = False
    ) -> Texture | None:
        """The texture that a table refers to; None if it refers to none, or to one whose picture cannot be had."""
        document, where = self.document, f"{place}.{key}"
        if table.get(key) is None:
            return None
        info = document.table(table[key], where)
        number = info.get("index")
        entry = document.entry("textures", number, f"{where}.index")
        picture = self._picture(entry, f"textures[{number}]", with_alpha=with_alpha)
        if picture is None:
            return None
        sampler: Table = {}
        if entry.get("sampler") is not None:
            sampler = document.entry("samplers", entry["sampler"], f"textures[{number}].sampler")
        wrap_u, wrap_v = (_wrap(sampler, key, f"samplers[{entry.get('sampler')}]") for key in ("wrapS", "wrapT"))
        moved = document.extension(info, "KHR_texture_transform", where)
        uv_set = document.whole(info, "texCoord", where, 0)
        transform: tuple[float, ...] = IDENTITY
        if moved is not None:
            place = f"{where}.extensions.KHR_texture_transform"
            uv_set = document.whole(moved, "texCoord", place, uv_set)
            transform = _transform(document, moved, place)
        return Texture(
            picture,
            uv_set=uv_set,
            wrap=(wrap_u, wrap_v),
            is_nearest=sampler.get("magFilter") == NEAREST,
            transform=transform,
            is_data=is_data,
        )

    def _picture(self, entry: Table, where: str, *, with_alpha: bool) -> StoredPicture | None:
        """The picture of a texture. None, and a line in ``faults``, if it has none that can be read: the shape can be
        shown all the same."""
        document = self.document
        sources = [document.extension(entry, name, where) for name in IMAGE_SOURCES]
        named = [table["source"] for table in sources if table is not None and "source" in table]
        number = named[0] if named else entry.get("source")
        if number is None:
            self.faults.append(f"{where} has no picture of a kind that is read")
            return None
        image = document.entry("images", number, f"{where}.source")
        if (number, with_alpha) not in self._pictures:
            self._pictures[number, with_alpha] = self._unpacked(image, f"images[{number}]", with_alpha=with_alpha)
        return self._pictures[number, with_alpha]

    def _unpacked(self, image: Table, where: str, *, with_alpha: bool) -> StoredPicture | None:
        view = None
        if image.get("bufferView") is not None:
            view = self.document.view(image["bufferView"], f"{where}.bufferView")
        try:
            data = self.document.file(image.get("uri"), f"{where}.uri") if view is None else bytes(view)
        except InputError as error:
            self._miss(error)
            return None
        try:
            return unpacked_picture(data, with_alpha=with_alpha)
        except InputError as error:
            self._miss(error.within(where))
            return None

    def _miss(self, error: InputError) -> None:
        """Name a picture that cannot be had; memory that is refused is an error all the same."""
        if budget.is_refusal(error):
            raise error
        if str(error) not in self.faults:
            self.faults.append(str(error))


def _wrap(sampler: Table, key: str, where: str) -> Wrap:
    mode = sampler.get(key, 10497)
    if not isinstance(mode, int) or mode not in WRAPS:
        raise InputError(f"{where}.{key}: allowed are {', '.join(map(str, WRAPS))}, got {mode!r:.40}")
    return WRAPS[mode]


def _transform(document: Document, table: Table, place: str) -> tuple[float, ...]:
    """The product translation x rotation x scale of KHR_texture_transform, two rows of three."""
    x, y = document.numbers(table, "offset", place, (0.0, 0.0))
    wide, high = document.numbers(table, "scale", place, (1.0, 1.0))
    angle = document.number(table, "rotation", place, 0.0)
    cosine, sine = math.cos(angle), math.sin(angle)
    return (cosine * wide, sine * high, x, -sine * wide, cosine * high, y)


def _fraction(value: float) -> float:
    return float(np.clip(value, 0.0, 1.0))


def _not_negative(color: tuple[float, float, float]) -> tuple[float, float, float]:
    red, green, blue = color
    return max(red, 0.0), max(green, 0.0), max(blue, 0.0)
