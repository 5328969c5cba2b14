"""Colours and textures: upright, and each part its own."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture
from ldtrefl.world.appearance import appearance_of
from tests.part_materials import textured

ROUNDING = 1e-6
"""Of float32: pixels see the middle of one colour, lit by 1."""


def quadrants(tmp_path: Path) -> Path:
    """A picture: red and green on top, blue and white below."""
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:32, :32], picture[:32, 32:] = (255, 0, 0), (0, 255, 0)
    picture[32:, :32], picture[32:, 32:] = (0, 0, 255), (255, 255, 255)
    Image.fromarray(picture).save(tmp_path / "quadrants.png")
    return tmp_path / "quadrants.png"


@pytest.mark.parametrize("is_filtered", [False, True], ids=["at points", "filtered"])
@pytest.mark.parametrize("method", ["bvh", "ldt"])
def test_textures_are_upright_directly_and_mirrored(tmp_path: Path, method: str, is_filtered: bool) -> None:
    texture = str(quadrants(tmp_path))
    camera = Camera(eye=(0, 0, 5), look_at=(0, 0, 0), up=(0, 1, 0), width=32, height=32, fov_y=10)
    lit = Lighting(ambient=(1, 1, 1))
    sheet = Object(shape="plane", material=Material(albedo=(1, 1, 1), texture=texture))
    direct = ldtrefl.render(
        Scene(camera=camera, lighting=lit, objects=(sheet,)), method, filter_textures=is_filtered
    ).image
    corners = [direct[4, 4], direct[4, 27], direct[27, 4], direct[27, 27]]
    np.testing.assert_allclose(corners, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], atol=ROUNDING)

    # Seen in a mirror behind the camera's target, the sheet facing the mirror: left and right exchanged.
    mirror = Object(shape="plane", scale=3.0, material=Material(albedo=(0, 0, 0), mirror=(1, 1, 1)))
    sheet = Object(
        shape="plane", scale=2.0, rotate=(0, 1, 0, 180), translate=(0, 0, 8), material=sheet.material, smooth=False
    )
    scene = Scene(camera=camera, lighting=lit, environment=Environment(), objects=(mirror, sheet))
    reflected = ldtrefl.render(scene, method, filter_textures=is_filtered).reflection
    # Turned by 180 degrees about y the sheet's left is at +x; the mirror shows it where it is.
    corners = [reflected[4, 27], reflected[4, 4], reflected[27, 27], reflected[27, 4]]
    np.testing.assert_allclose(corners, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], atol=ROUNDING)


def test_parts_keep_their_own_colours_and_textures(tmp_path: Path) -> None:
    def sheet(x: float, color: tuple[int, int, int]) -> trimesh.Trimesh:
        corners = [[x, 0, 0], [x + 1, 0, 0], [x + 1, 1, 0], [x, 1, 0]]
        uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
        material = trimesh.visual.material.PBRMaterial(
            baseColorTexture=Image.new("RGB", (2, 2), color), metallicFactor=0.0
        )
        visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], visual=visual, process=False)

    pieces = [sheet(-1.0, (255, 0, 0)), sheet(0.0, (0, 0, 255))]
    trimesh.Scene(pieces).export(tmp_path / "two.glb")
    camera = Camera(eye=(0, 0.5, 5), look_at=(0, 0.5, 0), up=(0, 1, 0), width=16, height=8, fov_y=8)
    thing = Object(mesh=str(tmp_path / "two.glb"), material=Material(albedo=(1, 1, 1)))
    dark = Environment(sky=(0, 0, 0), ground=(0, 0, 0))  # of which the surface reflects a little
    lit = Lighting(ambient=(1, 1, 1))
    image = ldtrefl.render(Scene(camera=camera, environment=dark, lighting=lit, objects=(thing,))).image
    np.testing.assert_allclose(image[4, 2] / image[4, 2].max(), [1, 0, 0], atol=ROUNDING)
    np.testing.assert_allclose(image[4, 13] / image[4, 13].max(), [0, 0, 1], atol=ROUNDING)


def test_textures_are_uploaded_once_and_by_kind() -> None:
    """Two parts share a picture of bytes, one has floats, one has none."""
    plane = shapes.make("plane", {"segments": 2})
    pixels = np.arange(18, dtype=np.uint8).reshape(2, 3, 3)
    first, alike = StoredPicture(pixels), StoredPicture(pixels.copy())
    floats = StoredPicture(np.linspace(0, 1, 12, dtype=np.float32).reshape(1, 4, 3))
    parts = (
        Part(0, textured(first)),
        Part(2, textured(floats)),
        Part(4, textured(alike)),
        Part(6, SurfaceMaterial(base_color=(0.0, 1.0, 0.0))),
    )
    made = appearance_of(Mesh(plane.vertices, plane.faces, None, plane.uvs, parts), None, launch.resolve_device("cpu"))
    assert made.part_first.numpy().tolist() == [0, 2, 4, 6] and made.part_color.numpy()[3].tolist() == [0, 1, 0]
    assert made.part_texture.numpy().tolist() == [[0, 3, 2, 1], [0, 4, 1, 0], [0, 3, 2, 1], [0, 0, 0, 0]]
    np.testing.assert_array_equal(made.texel_bytes.numpy(), pixels.reshape(-1, 3))
    np.testing.assert_array_equal(made.texels.numpy(), floats.pixels.reshape(-1, 3))


def test_a_materials_texture_takes_the_place_of_all_parts_own() -> None:
    plane = shapes.make("plane", {"segments": 2})
    own, given = (StoredPicture(np.full((1, 1, 3), value, np.uint8)) for value in (7, 9))
    mesh = Mesh(plane.vertices, plane.faces, None, plane.uvs, (Part(0, textured(own)), Part(4)))
    made = appearance_of(mesh, given, launch.resolve_device("cpu"))
    assert made.texel_bytes.numpy().tolist() == [[9, 9, 9]] and (made.part_texture.numpy()[:, 1] == 1).all()


def test_mip_maps_stand_beside_textures_that_are_filtered() -> None:
    """4 x 2 texels have maps of 2 x 1 and 1 x 1, after those of the picture before."""
    wide, one = np.full((2, 4, 3), 9, np.uint8), np.full((2, 2, 3), 7, np.uint8)
    materials = [SurfaceMaterial(base_texture=Texture(StoredPicture(picture))) for picture in (one, wide, one)]
    parts = tuple(Part(k, material) for k, material in enumerate(materials))
    square = shapes.make("plane")
    mesh = Mesh(square.vertices, np.tile(square.faces[:1], (3, 1)), uvs=square.uvs, parts=parts)
    plain, filtered = (appearance_of(mesh, None, launch.resolve_device("cpu"), filters=f) for f in (False, True))
    assert plain.part_mips.shape == (0,) and plain.mip_bytes.shape == (0,)
    assert filtered.part_mips.numpy().tolist() == [0, 1, 0]
    assert filtered.mip_bytes.numpy()[:, 0].tolist() == [7, 9, 9, 9]
    assert filtered.mip_texels.shape == (0,)
