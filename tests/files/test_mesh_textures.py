"""Textures of mesh files: as they are stored in the file, shared where they are equal, and asked for first."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from PIL import Image

import ldtrefl
from ldtrefl import InputError, load_image
from ldtrefl.files.mesh_textures import stored_texture, take_memory_for_textures, texture_of
from ldtrefl.scene import shapes

COLOR = (200, 100, 50)


def write_glb(path: Path, picture: Image.Image) -> None:
    plane = shapes.make("plane", {})
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=picture)
    visual = trimesh.visual.TextureVisuals(uv=plane.uvs, material=material)
    trimesh.Trimesh(plane.vertices, plane.faces, visual=visual, process=False).export(path)


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "LA", "P"])
def test_textures_of_a_glb(tmp_path: Path, mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pillow's own limit, which readers take for a missing picture, is not ours."""
    pixels = np.random.default_rng(0).integers(0, 256, (64, 48, 4), dtype=np.uint8)
    picture = Image.fromarray(pixels).convert("LA" if mode == "LA" else "RGBA")
    picture = picture.convert("RGB").convert(mode) if mode in ("RGB", "P") else picture
    write_glb(tmp_path / "a.glb", picture)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)
    texture = ldtrefl.load_mesh(tmp_path / "a.glb").parts[0].material.base_texture.picture
    assert texture is not None and texture.pixels.dtype == np.uint8
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", None)
    np.testing.assert_array_equal(texture.pixels, np.asarray(picture.convert("RGB")))
    assert Image.MAX_IMAGE_PIXELS is None


def test_sixteen_bits_of_a_mesh_are_scaled_and_the_same_picture_is_one(tmp_path: Path) -> None:
    values = np.arange(24, dtype=np.uint16).reshape(4, 6) * 2700 + 11
    Image.fromarray(values).save(tmp_path / "a.png")
    read = [stored_texture(Image.open(tmp_path / "a.png")) for _ in range(2)]
    assert read[0] is read[1] and not read[0].pixels.flags.writeable
    np.testing.assert_array_equal(read[0].pixels, load_image(tmp_path / "a.png"))


def test_a_glb_of_large_textures_is_asked_for_first(tmp_path: Path, small_limit: None) -> None:
    write_glb(tmp_path / "a.glb", Image.new("RGB", (400, 400), COLOR))
    with pytest.raises(
        InputError, match=r"a\.glb: .*a texture of 400 x 400 pixels needs 1\.8 MiB.*, allowed are 1\.0 MiB"
    ):
        ldtrefl.load_mesh(tmp_path / "a.glb")


def test_the_texture_of_a_material_is_its_base_color() -> None:
    picture = Image.new("RGB", (6, 4), COLOR)
    assert texture_of(SimpleNamespace(baseColorTexture=picture, image=None)) is picture
    assert texture_of(SimpleNamespace(baseColorTexture=None, image=picture)) is picture
    assert texture_of(SimpleNamespace()) is None
    take_memory_for_textures([None, SimpleNamespace(image=picture)])


def test_a_damaged_texture_is_refused(tmp_path: Path) -> None:
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)).save(tmp_path / "a.png")
    whole = (tmp_path / "a.png").read_bytes()
    (tmp_path / "a.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="a texture is cut off or damaged"):
        stored_texture(Image.open(tmp_path / "a.png"))
