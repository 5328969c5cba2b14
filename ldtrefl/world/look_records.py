"""What kernels read of looks: materials in glTF's terms, one for each part of a mesh, and their textures.

Objects whose surface is one colour, a picture or a mirror have no look: ``ObjectRecord`` says all of them.
"""

from __future__ import annotations

import warp as wp

BASE = wp.constant(0)
"""Slot of the base colour and alpha among a material's textures; the other slots follow."""
METALLIC_ROUGHNESS = wp.constant(1)
NORMAL = wp.constant(2)
OCCLUSION = wp.constant(3)
EMISSION = wp.constant(4)
SPECULAR = wp.constant(5)
SPECULAR_COLOR = wp.constant(6)
CLEARCOAT = wp.constant(7)
CLEARCOAT_ROUGHNESS = wp.constant(8)
SLOTS = wp.constant(9)

SlotNumbers = wp.types.vector(length=9, dtype=wp.int32)  # type: ignore[no-untyped-call]

OPAQUE = wp.constant(0)
"""Modes of alpha."""
MASK = wp.constant(1)
BLEND = wp.constant(2)

LINEAR_FLOATS = wp.constant(0)
"""How texels are stored."""
SRGB_BYTES = wp.constant(1)
FRACTION_BYTES = wp.constant(2)

REPEAT = wp.constant(0)
"""What lies beyond a picture."""
CLAMP = wp.constant(1)
MIRROR = wp.constant(2)


@wp.struct
class TextureRecord:
    """A picture, and how it is laid on a surface."""

    first: int  # its first texel, row 0 at the top
    width: int
    height: int
    stored: int  # LINEAR_FLOATS, SRGB_BYTES or FRACTION_BYTES
    first_alpha: int  # the alpha of its first texel; -1 if it is opaque
    first_mip: int  # the first texel of its mip maps, if it is filtered
    first_mip_alpha: int  # and the alpha of that
    uv_set: int
    wrap: wp.vec2i  # along u and v
    is_nearest: int
    across: wp.vec3  # the picture is read at across . (u, v, 1), with v = 0 and 0 at its top row,
    down: wp.vec3  # and down . (u, v, 1)


@wp.struct
class MaterialRecord:
    """What a part of a mesh looks like: the fields of ``SurfaceMaterial``, with what the scene says of the object."""

    base: wp.vec3
    alpha: float
    alpha_mode: int  # OPAQUE, MASK or BLEND
    alpha_cutoff: float
    emission: wp.vec3
    is_unlit: int
    metallic: float
    roughness: float
    dielectric: float  # reflectance of the dielectric at normal incidence, by its index of refraction
    specular: float  # times that, and how much it reflects along the surface
    specular_color: wp.vec3  # times the former
    clearcoat: float
    clearcoat_roughness: float
    mirror: wp.vec3  # reflectance that the scene gives in place of the model's, where it gives one
    has_mirror: int
    has_fresnel: int  # of the mirror
    has_highlights: int  # whether lights are mirrored, too
    reflects: int  # whether a ray may be sent from some place of its front, mirrored or straight on
    hides_back: int  # whether what is seen of its back is not there: rays go straight on
    normal_scale: float
    occlusion_strength: float
    slots: int  # texture slots that are looked at: up to the last one with a texture
    textures: SlotNumbers  # among the look's; -1 for none


@wp.struct
class LookRecord:
    """The materials and textures of a mesh's parts, and what its vertices have beside ``ObjectRecord``."""

    uvs: wp.array(dtype=wp.vec2)  # v = 0 at the bottom; empty without any
    second_uvs: wp.array(dtype=wp.vec2)  # likewise
    colors: wp.array(dtype=wp.vec4)  # linear, with alpha; empty without any
    tangents: wp.array(dtype=wp.vec4)  # along u in unit space, then the bitangent's sign; empty without any
    materials: wp.array(dtype=MaterialRecord)  # of each part
    textures: wp.array(dtype=TextureRecord)
    texels: wp.array(dtype=wp.vec3)  # of pictures of floats, linear
    texel_bytes: wp.array(dtype=wp.vec3ub)  # of pictures of 8 bits
    texel_alpha: wp.array(dtype=wp.uint8)
    mip_texels: wp.array(dtype=wp.vec3)  # the mip maps of all three; empty if nothing is filtered
    mip_bytes: wp.array(dtype=wp.vec3ub)
    mip_alpha: wp.array(dtype=wp.uint8)
    has_image: wp.array(dtype=wp.uint8)  # of each triangle, where backs are hidden: 1 if its back stands for the front
    # of another one, which lies in the same place the other way round; empty if none does
    lets_through: int  # 1 if some part lets light through by its alpha


@wp.struct
class Looks:
    """The looks of a scene's objects."""

    records: wp.array(dtype=LookRecord)
    decoded: wp.array(dtype=float)  # the linear value of every byte of sRGB
    shares: wp.array(dtype=wp.vec3)  # how much rough surfaces reflect (``reflectance_table.py``)
    environment: wp.array3d(dtype=wp.vec3)  # its picture, rougher and rougher (``rough_environment.py``); or empty
    threshold: float  # reflectance from which on a ray is sent
    rough_limit: float  # roughness up to which one is
