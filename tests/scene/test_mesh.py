"""Mesh files: what is in them arrives; textures keep their place."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import ldtrefl
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene import shapes
from ldtrefl.scene.description import Camera, Environment, Lighting, Material, Object, Scene
from ldtrefl.scene.mesh import Part
from tests.conftest import REAL_MESHES


@pytest.mark.parametrize("name", REAL_MESHES)
def test_real_meshes_load(real_mesh: Callable, name: str) -> None:
    mesh = real_mesh(name)
    assert mesh.faces.max() < len(mesh.vertices)
    lengths = np.linalg.norm(mesh.normals, axis=1)
    assert ((np.abs(lengths - 1) < 1e-3) | (lengths == 0)).all()
    assert (lengths[mesh.is_used] == 0).mean() < 0.01, "vertices of triangles without area alone have no normal"
    assert (mesh.uvs is not None) == any(part.texture is not None for part in mesh.parts)


@pytest.mark.parametrize("kind", ["ply", "obj", "stl", "off", "glb"])
def test_every_common_format(tmp_path: Path, kind: str) -> None:
    trimesh.creation.icosphere(2).export(tmp_path / f"ball.{kind}")
    mesh = ldtrefl.load_mesh(tmp_path / f"ball.{kind}")
    assert len(mesh.faces) == 320
    np.testing.assert_allclose(mesh.bounds, [[-1, -1, -1], [1, 1, 1]], atol=0.02)
    np.testing.assert_allclose(mesh.normals, mesh.vertices, atol=0.05)  # smooth, whether corners are shared or not


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "ball.ply"
    trimesh.creation.icosphere(1).export(path)
    first = ldtrefl.load_mesh(path)
    assert ldtrefl.load_mesh(path) is first
    trimesh.creation.icosphere(2).export(path)
    assert len(ldtrefl.load_mesh(path).faces) == 320


def quadrants(tmp_path: Path) -> Path:
    """A picture: red and green on top, blue and white below."""
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:32, :32], picture[:32, 32:] = (255, 0, 0), (0, 255, 0)
    picture[32:, :32], picture[32:, 32:] = (0, 0, 255), (255, 255, 255)
    Image.fromarray(picture).save(tmp_path / "quadrants.png")
    return tmp_path / "quadrants.png"


@pytest.mark.parametrize("method", ["bvh", "ldt"])
def test_textures_are_upright_directly_and_mirrored(tmp_path: Path, method: str) -> None:
    texture = str(quadrants(tmp_path))
    camera = Camera(eye=(0, 0, 5), look_at=(0, 0, 0), up=(0, 1, 0), width=32, height=32, fov_y=10)
    lit = Lighting(ambient=(1, 1, 1))
    sheet = Object(shape="plane", material=Material(albedo=(1, 1, 1), texture=texture))
    direct = ldtrefl.render(Scene(camera=camera, lighting=lit, objects=(sheet,)), method).image
    corners = [direct[4, 4], direct[4, 27], direct[27, 4], direct[27, 27]]
    np.testing.assert_allclose(corners, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], atol=1e-3)

    # Seen in a mirror behind the camera's target, the sheet facing the mirror: left and right exchanged.
    mirror = Object(shape="plane", scale=3.0, material=Material(albedo=(0, 0, 0), mirror=(1, 1, 1)))
    sheet = Object(
        shape="plane", scale=2.0, rotate=(0, 1, 0, 180), translate=(0, 0, 8), material=sheet.material, smooth=False
    )
    scene = Scene(camera=camera, lighting=lit, environment=Environment(), objects=(mirror, sheet))
    reflected = ldtrefl.render(scene, method).reflection
    # Turned by 180 degrees about y the sheet's left is at +x; the mirror shows it where it is.
    corners = [reflected[4, 27], reflected[4, 4], reflected[27, 27], reflected[27, 4]]
    np.testing.assert_allclose(corners, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], atol=1e-2)


def test_environment_picture_is_looked_up_upright(tmp_path: Path) -> None:
    """For up = +z the middle column is +x, columns run clockwise seen from above, and the top row is up."""
    picture = np.zeros((32, 64, 3), np.float32)
    picture[:, 32 + 16 - 2 : 32 + 16 + 2, 0] = 1.0  # a quarter turn clockwise from +x: -y
    picture[:4, :, 1] = 1.0
    ldtrefl.save_image(tmp_path / "sky.exr", picture)
    sky = Environment(image=str(tmp_path / "sky.exr"))

    def seen(target: tuple[float, float, float], up: tuple[float, float, float] = (0, 0, 1)) -> np.ndarray:
        camera = Camera(eye=(0, 0, 0), look_at=target, up=up, width=1, height=1, fov_y=0.1)
        return ldtrefl.render(Scene(camera=camera, environment=sky)).image[0, 0]

    np.testing.assert_allclose(seen((0, -1, 0)), [1, 0, 0], atol=1e-4)
    np.testing.assert_allclose(seen((0, 1, 0)), [0, 0, 0], atol=1e-4)
    np.testing.assert_allclose(seen((1, 0, 0)), [0, 0, 0], atol=1e-4)
    np.testing.assert_allclose(seen((0.01, 0, 1)), [0, 1, 0], atol=1e-4)


def test_parts_keep_their_own_colours_and_textures(tmp_path: Path) -> None:
    def sheet(x: float, color: tuple[int, int, int]) -> trimesh.Trimesh:
        corners = [[x, 0, 0], [x + 1, 0, 0], [x + 1, 1, 0], [x, 1, 0]]
        uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
        material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.new("RGB", (2, 2), color))
        visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], visual=visual, process=False)

    pieces = [sheet(-1.0, (255, 0, 0)), sheet(0.0, (0, 0, 255))]
    trimesh.Scene(pieces).export(tmp_path / "two.glb")
    camera = Camera(eye=(0, 0.5, 5), look_at=(0, 0.5, 0), up=(0, 1, 0), width=16, height=8, fov_y=8)
    thing = Object(mesh=str(tmp_path / "two.glb"), material=Material(albedo=(1, 1, 1)))
    image = ldtrefl.render(Scene(camera=camera, lighting=Lighting(ambient=(1, 1, 1)), objects=(thing,))).image
    np.testing.assert_allclose(image[4, 2], [1, 0, 0], atol=1e-3)
    np.testing.assert_allclose(image[4, 13], [0, 0, 1], atol=1e-3)


def test_the_key_of_a_mesh_is_its_content() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces, normals, uvs = [[0, 1, 2], [1, 2, 3]], np.eye(4, 3), np.eye(4, 2)
    pixels = [np.full((2, 2, 3), value, np.uint8) for value in (1, 1, 2)]
    red, alike, other = (Part(0, (1.0, 0.0, 0.0), StoredPicture(entry)) for entry in pixels)
    mesh = ldtrefl.Mesh(vertices, faces, normals, uvs, (red,))
    assert ldtrefl.Mesh(vertices.copy(), faces, normals, uvs, (alike,)).key == mesh.key
    assert ldtrefl.Mesh(vertices, faces, None, uvs, (red,)).with_normals(normals).key == mesh.key
    changed = [
        ldtrefl.Mesh(vertices + 1e-9, faces, normals, uvs, (red,)),
        ldtrefl.Mesh(vertices, faces[::-1], normals, uvs, (red,)),
        ldtrefl.Mesh(vertices, faces, -normals, uvs, (red,)),
        ldtrefl.Mesh(vertices, faces, None, uvs, (red,)),
        ldtrefl.Mesh(vertices, faces, normals, 2.0 * uvs, (red,)),
        ldtrefl.Mesh(vertices, faces, normals, uvs, (other,)),
        ldtrefl.Mesh(vertices, faces, normals, uvs, (red, Part(1))),
    ]
    assert len({entry.key for entry in (mesh, *changed)}) == 8
    assert [entry.surface_key == mesh.surface_key for entry in changed] == [False, False, True, True, True, True, True]


def test_normals_are_one_a_vertex() -> None:
    plane = shapes.make("plane", {})
    with pytest.raises(ldtrefl.InputError, match=f"3 normals for {len(plane.vertices)} vertices"):
        plane.with_normals(np.eye(3))


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int), "no triangles"),
        (np.eye(3), np.zeros((0, 3), int), "no triangles"),
        (np.eye(3), [[0, 1, 3]], r"triangle 0 has vertices \[0, 1, 3\], allowed are 0 to 2"),
        (np.eye(3), [[0, 1, 2], [0, -1, 2]], "triangle 1 has vertices"),
        (np.where(np.eye(3) > 0, np.nan, 0), [[0, 1, 2]], "vertex 0 is not finite"),
        (np.diag([1, np.inf, 1]), [[0, 1, 2]], "vertex 1 is not finite"),
        (np.eye(2), [[0, 1, 2]], r"vertices must have shape \(n, 3\), got \(2, 2\)"),
        (np.eye(3), [[0, 1]], r"faces must have shape \(n, 3\)"),
        (np.eye(3), [[0.5, 1, 2]], "whole numbers"),
        ("corner", [[0, 1, 2]], "vertices must be numbers"),
    ],
)
def test_wrong_arrays(vertices: object, faces: object, message: str) -> None:
    for maker in (ldtrefl.peel, ldtrefl.Raycaster):
        with pytest.raises(ldtrefl.InputError, match=message):
            maker(vertices, faces)
