"""Which extensions of glTF are read, and what is done with the others."""

from __future__ import annotations

from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import Document

READ = frozenset(
    {
        "EXT_mesh_gpu_instancing",
        "EXT_meshopt_compression",
        "EXT_texture_webp",
        "KHR_draco_mesh_compression",
        "KHR_lights_punctual",
        "KHR_materials_clearcoat",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_specular",
        "KHR_materials_unlit",
        "KHR_mesh_quantization",
        "KHR_meshopt_compression",
        "KHR_texture_transform",
    }
)
"""Extensions whose meaning is in the picture."""

OPAQUE = frozenset({"KHR_materials_transmission", "KHR_materials_volume"})
"""Extensions of glass, which is opaque here."""

HARMLESS = frozenset(
    {
        "KHR_animation_pointer",
        "KHR_materials_variants",
        "KHR_node_visibility",
        "KHR_xmp",
        "KHR_xmp_json_ld",
        "MSFT_lod",
    }
)
"""Extensions whose absence leaves the picture of the file as it is stored."""


def check_required(document: Document, *, lenient: bool) -> None:
    """Refuse an asset that requires what is not read, unless ``lenient``.

    Raises:
        InputError: naming the extensions.
    """
    unknown = sorted(set(_names(document, "extensionsRequired")) - READ - OPAQUE - HARMLESS)
    if unknown and not lenient:
        way_round = "--lenient, or lenient = true of an [[include]], tries all the same"
        raise InputError(f"it requires {', '.join(unknown)}, which is not read ({way_round})")


def not_shown(document: Document) -> list[str]:
    """What the asset uses and the picture does not show: extensions, a line each."""
    used = set(_names(document, "extensionsUsed")) | set(_names(document, "extensionsRequired"))
    lines = [f"{name} (shown as opaque)" for name in sorted(used & OPAQUE)]
    return lines + sorted(used - READ - OPAQUE - HARMLESS)


def _names(document: Document, key: str) -> list[str]:
    found = document.root.get(key, [])
    if not isinstance(found, list) or not all(isinstance(name, str) for name in found):
        raise InputError(f"{key}: should be a list of names")
    return found
