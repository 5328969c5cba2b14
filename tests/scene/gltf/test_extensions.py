"""Extensions: what a file requires is read or refused by name; what it uses and is not shown is named."""

import pytest

from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.asset import Asset
from tests.scene.gltf.writer import Written, nothing_beside


def read(lenient: bool = False, **tree: object) -> Asset:
    """A file that holds nothing else."""
    return Asset.read(Written(**tree).as_glb(), nothing_beside, lenient=lenient)


def test_what_is_required_and_not_read_is_refused_by_name() -> None:
    wanted = ["KHR_texture_basisu", "KHR_mesh_quantization"]
    with pytest.raises(InputError, match=r"it requires KHR_texture_basisu, which is not read \(--lenient"):
        read(extensionsRequired=wanted, extensionsUsed=wanted)
    assert read(lenient=True, extensionsRequired=wanted).not_shown() == ["KHR_texture_basisu"]


def test_what_is_used_and_not_shown_is_named() -> None:
    used = ["KHR_materials_sheen", "KHR_materials_transmission", "KHR_lights_punctual", "KHR_xmp"]
    assert read(extensionsUsed=used).not_shown() == [
        "KHR_materials_transmission (shown as opaque)",
        "KHR_materials_sheen",
    ]


def test_a_list_of_extensions_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="extensionsUsed: should be a list of names"):
        read(extensionsUsed="KHR_xmp").not_shown()
