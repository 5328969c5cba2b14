"""Materials of mesh files: what a part of a mesh looks like, in the terms of glTF 2.0.

The model is glTF's metallic-roughness (3.9 and appendix B of its specification) with the extensions that are named
below. A material of another kind of file, which scatters light diffusely and no more, has ``specular`` 0.
"""

from __future__ import annotations

import dataclasses
import functools
import json
from dataclasses import dataclass
from typing import Literal

from ldtrefl.files.content_key import content_key
from ldtrefl.files.stored_picture import StoredPicture

Rgb = tuple[float, float, float]
Wrap = Literal["repeat", "clamp", "mirror"]

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture, and how it is laid on a surface."""

    picture: StoredPicture
    uv_set: int = 0
    """Which of the mesh's texture coordinates: 0 or 1."""
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    """What lies beyond the picture, along u and along v."""
    is_nearest: bool = False
    """The nearest texel counts, rather than a blend of four."""
    transform: tuple[float, ...] = IDENTITY
    """(a, b, c, d, e, f): the picture is read at (a u + b v + c, d u + e v + f), with v = 0 at its top row
    (KHR_texture_transform)."""
    is_data: bool = False
    """Its bytes are fractions, as of normals and roughness, not sRGB."""

    @functools.cached_property
    def key(self) -> str:
        """A hash of all that it holds."""
        layout = [self.uv_set, *self.wrap, self.is_nearest, *self.transform, self.is_data]
        return content_key(json.dumps(layout), self.picture.key)


@dataclass(frozen=True, eq=False)
class SurfaceMaterial:
    """What a surface looks like. Colours are linear; a texture is times the number beside it."""

    name: str = ""
    base_color: Rgb = (1.0, 1.0, 1.0)
    base_texture: Texture | None = None
    alpha: float = 1.0
    alpha_mode: Literal["opaque", "mask", "blend"] = "opaque"
    alpha_cutoff: float = 0.5
    """With "mask", what has less alpha is not there."""
    metallic: float = 0.0
    roughness: float = 1.0
    metallic_roughness_texture: Texture | None = None
    """Roughness is its green, metallic its blue channel."""
    normal_texture: Texture | None = None
    normal_scale: float = 1.0
    occlusion_texture: Texture | None = None
    """Its red channel."""
    occlusion_strength: float = 1.0
    emission: Rgb = (0.0, 0.0, 0.0)
    """Radiance."""
    emission_texture: Texture | None = None
    double_sided: bool = True
    """Seen from behind, too; else what is seen there is not there, but for light, whose way it stands in."""
    ior: float = 1.5
    """KHR_materials_ior; 0 stands for infinity."""
    specular: float = 0.0
    """KHR_materials_specular: strength of the dielectric's reflection, 1 in a glTF file that does not say so."""
    specular_color: Rgb = (1.0, 1.0, 1.0)
    """Tint of that reflection at normal incidence."""
    specular_texture: Texture | None = None
    """Its alpha channel, as an opaque grey picture."""
    specular_color_texture: Texture | None = None
    clearcoat: float = 0.0
    """KHR_materials_clearcoat: a second layer of varnish."""
    clearcoat_texture: Texture | None = None
    clearcoat_roughness: float = 0.0
    clearcoat_roughness_texture: Texture | None = None
    is_unlit: bool = False
    """KHR_materials_unlit: the base colour is what is seen, whatever lights there are."""

    @functools.cached_property
    def key(self) -> str:
        """A hash of all that it holds but its name."""
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "name"}
        textures = [value.key if isinstance(value, Texture) else None for value in values.values()]
        plain = [value for value in values.values() if not isinstance(value, Texture)]
        return content_key(json.dumps(plain), *textures)

    @property
    def reflects(self) -> bool:
        """Whether it reflects anything: else it is matt, however rough it is said to be."""
        return self.metallic > 0.0 or self.specular > 0.0 or self.clearcoat > 0.0

    @property
    def textures(self) -> list[Texture]:
        """All that it has."""
        values = [getattr(self, field.name) for field in dataclasses.fields(self)]
        return [value for value in values if isinstance(value, Texture)]


PLAIN = SurfaceMaterial()
"""White, and matt."""
