"""Materials: every number and texture of the file, its samplers and transforms; pictures that are missing are named."""

import dataclasses
import io
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import Document
from ldtrefl.scene.gltf.materials import Materials
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial
from tests.scene.gltf.writer import Written, nothing_beside

PIXELS = np.array([[[255, 0, 0, 255], [0, 255, 0, 128]], [[0, 0, 255, 0], [10, 20, 30, 40]]], np.uint8)


def picture(kind: str = "PNG", mode: str = "RGBA") -> bytes:
    """The four pixels in a file."""
    made = io.BytesIO()
    Image.fromarray(PIXELS).convert(mode).save(made, kind, **({"lossless": True} if kind == "WEBP" else {}))
    return made.getvalue()


def textured(sampler: dict[str, Any] | None = None, data: bytes | None = None) -> Written:
    """A file with one texture, number 0."""
    file = Written()
    file.add("images", {"bufferView": file.view(picture() if data is None else data)})
    texture: dict[str, Any] = {"source": 0}
    if sampler is not None:
        texture["sampler"] = file.add("samplers", sampler)
    file.add("textures", texture)
    return file


def material_of(file: Written, **entry: Any) -> SurfaceMaterial:
    """The file's only material."""
    file.tree["materials"] = [entry]
    return Materials(Document(file.as_glb(), nothing_beside)).material(0)


def test_defaults_are_the_specification_s() -> None:
    made = material_of(Written())
    assert (made.base_color, made.alpha, made.metallic, made.roughness) == ((1, 1, 1), 1, 1, 1)
    assert (made.alpha_mode, made.alpha_cutoff, made.double_sided) == ("opaque", 0.5, False)
    assert (made.ior, made.specular, made.clearcoat, made.is_unlit, made.emission) == (1.5, 1, 0, False, (0, 0, 0))
    assert made.textures == []


def test_a_primitive_without_a_material_is_white_plaster() -> None:
    made = Materials(Document(Written().as_glb(), nothing_beside)).material(None)
    assert not made.double_sided and dataclasses.replace(made, double_sided=True).key == PLAIN.key


def test_every_number_is_read() -> None:
    made = material_of(
        Written(),
        name="paint",
        pbrMetallicRoughness={"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.6},
        emissiveFactor=[0.1, 0.2, 0.3],
        alphaMode="MASK",
        alphaCutoff=0.25,
        doubleSided=True,
        extensions={
            "KHR_materials_emissive_strength": {"emissiveStrength": 10},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_specular": {"specularFactor": 0.7, "specularColorFactor": [1, 0.5, 2]},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.8, "clearcoatRoughnessFactor": 0.05},
            "KHR_materials_unlit": {},
        },
    )
    assert (made.name, made.base_color, made.alpha) == ("paint", (0.1, 0.2, 0.3), 0.4)
    assert (made.metallic, made.roughness, made.ior) == (0.5, 0.6, 1.33)
    assert made.emission == pytest.approx((1, 2, 3))
    assert (made.alpha_mode, made.alpha_cutoff, made.double_sided, made.is_unlit) == ("mask", 0.25, True, True)
    assert (made.specular, made.specular_color) == (0.7, (1, 0.5, 2))
    assert (made.clearcoat, made.clearcoat_roughness) == (0.8, 0.05)


@pytest.mark.parametrize("kind", ["PNG", "WEBP"])
def test_pictures_are_read_as_they_are_stored(kind: str) -> None:
    made = material_of(textured(data=picture(kind)), pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
    assert made.base_texture is not None and made.base_texture.picture.alpha is None
    shown = made.base_texture.picture.pixels
    np.testing.assert_array_equal(shown[0], PIXELS[0, :, :3])


def test_alpha_is_kept_where_it_counts() -> None:
    table = {"baseColorTexture": {"index": 0}}
    made = material_of(textured(), pbrMetallicRoughness=table, alphaMode="BLEND")
    assert made.base_texture is not None and made.base_texture.picture.alpha is not None
    np.testing.assert_array_equal(made.base_texture.picture.alpha, PIXELS[..., 3])


def test_the_webp_picture_of_a_texture_is_taken() -> None:
    file = textured()
    other = file.add("images", {"bufferView": file.view(picture("WEBP", "L"))})
    file.tree["textures"][0]["extensions"] = {"EXT_texture_webp": {"source": other}}
    made = material_of(file, pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
    assert made.base_texture is not None
    assert len(np.unique(made.base_texture.picture.pixels[0, 0])) == 1  # grey


@pytest.mark.parametrize(("sampler", "wrap", "nearest"), [
    (None, ("repeat", "repeat"), False),
    ({"wrapS": 33071, "wrapT": 33648}, ("clamp", "mirror"), False),
    ({"magFilter": 9728, "wrapS": 10497}, ("repeat", "repeat"), True),
])  # fmt: skip
def test_samplers_say_how_a_picture_is_read(sampler: Any, wrap: tuple[str, str], nearest: bool) -> None:
    texture = material_of(textured(sampler), emissiveTexture={"index": 0, "texCoord": 1}).emission_texture
    assert texture is not None
    assert (texture.wrap, texture.is_nearest, texture.uv_set, texture.is_data) == (wrap, nearest, 1, False)


def test_a_transform_is_offset_times_rotation_times_scale() -> None:
    """The specification's example: the lower left quarter of a picture, turned clockwise."""
    quarter = {"offset": [0, 1], "rotation": math.pi / 2, "scale": [0.5, 0.5], "texCoord": 1}
    info = {"index": 0, "extensions": {"KHR_texture_transform": quarter}}
    texture = material_of(textured(), normalTexture={**info, "scale": 0.5}).normal_texture
    assert texture is not None and texture.uv_set == 1 and texture.is_data
    a, b, c, d, e, f = texture.transform
    corners = np.array([[a * u + b * v + c, d * u + e * v + f] for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))])
    np.testing.assert_allclose(corners, [[0, 1], [0, 0.5], [0.5, 0.5], [0.5, 1]], atol=1e-12)


@pytest.mark.parametrize(
    ("image", "says"),
    [
        (picture()[:40], r"images\[0\]: not a picture that can be read"),
        (b"no picture", r"images\[0\]: not a picture that can be read"),
        ({"uri": "wood.png"}, r"images\[0\]\.uri: no file 'wood\.png' beside it"),
        ({"uri": "../wood.png"}, r"images\[0\]\.uri: no file '\.\./wood\.png' beside it"),
        ({"uri": "https://a.b/wood.png"}, r"images\[0\]\.uri: only files beside it are read"),
    ],
    ids=["cut off", "damaged", "missing", "outside", "far away"],
)
def test_a_picture_that_is_damaged_or_missing_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, image: bytes | dict, says: str
) -> None:
    """As in files of all other kinds: the shape is shown, once said, without it."""
    file = textured(data=image if isinstance(image, bytes) else None)
    if isinstance(image, dict):
        file.tree["images"] = [image]
    texture = {"index": 0}
    file.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": texture}, "emissiveTexture": texture}]
    file.quad()
    file.tree["meshes"][0]["primitives"][0]["material"] = 0
    assert ldtrefl.load_mesh(file.save(tmp_path, "a.glb")).parts[0].material.textures == []
    assert [
        record.getMessage() for record in caplog.records if re.search(rf"a\.glb: not shown: {says}", record.message)
    ]
    assert len(caplog.records) == 1


def test_a_picture_that_is_too_large_is_refused() -> None:
    budget.set_memory_limit(1 << 20)
    large = io.BytesIO()
    Image.new("L", (2000, 2000)).save(large, "PNG")
    with pytest.raises(InputError, match=r"images\[0\]: .*--memory"):
        material_of(textured(data=large.getvalue()), pbrMetallicRoughness={"baseColorTexture": {"index": 0}})


def test_a_texture_without_a_picture_is_named() -> None:
    file = Written(textures=[{}], materials=[{"emissiveTexture": {"index": 0}}])
    materials = Materials(Document(file.as_glb(), nothing_beside))
    assert materials.material(0).emission_texture is None
    assert materials.faults == ["textures[0] has no picture of a kind that is read"]


@pytest.mark.parametrize(("entry", "match"), [
    ({"alphaMode": "GLASS"}, r"materials\[0\]\.alphaMode: allowed are"),
    ({"pbrMetallicRoughness": {"metallicFactor": "1"}}, "metallicFactor: should be a number"),
    ({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1]}}, "should be 4 numbers"),
    ({"emissiveTexture": {"index": 1}}, r"there is no textures\[1\]"),
    ({"emissiveTexture": 1}, "should be an object"),
])  # fmt: skip
def test_what_is_unsound_is_refused(entry: dict[str, Any], match: str) -> None:
    with pytest.raises(InputError, match=match):
        material_of(textured(), **entry)


def test_a_texture_without_coordinates_is_left_out_and_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    file = textured()
    file.tree["materials"] = [{"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    file.quad(material=0)
    mesh = ldtrefl.load_mesh(file.save(tmp_path))
    assert mesh.parts[0].material.base_texture is None
    assert "not shown: a texture of material 'wood'" in caplog.text
