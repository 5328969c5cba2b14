"""One mesh of all pieces: none is lost, and each keeps its normals and its material."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import ldtrefl
from ldtrefl.scene.joining import joined_mesh
from ldtrefl.scene.piece import Piece
from tests.mesh_writers import write_glb, write_ply
from tests.part_materials import picture_of
from tests.scene.readers.soft_box import SCENE


def test_pieces_without_normals_get_smooth_ones_each_by_itself() -> None:
    ball = trimesh.creation.icosphere(2)
    upper = ball.faces[ball.vertices[ball.faces][..., 2].mean(axis=1) > 0]
    pieces = [Piece(ball.vertices, ball.faces, -ball.vertices, None), Piece(ball.vertices, upper, None, None)]
    mesh, count = joined_mesh(pieces), len(ball.vertices)
    np.testing.assert_allclose(mesh.normals[:count], -ball.vertices, atol=1e-6)
    np.testing.assert_array_equal(mesh.normals[count:], ldtrefl.Mesh(ball.vertices, upper).normals)


def test_a_piece_that_continues_another_is_smooth_with_it() -> None:
    ball = trimesh.creation.icosphere(3)
    upper = ball.triangles_center[:, 2] > 0
    for continues, most in ((True, 0.01), (False, 0.3)):
        pieces = [
            Piece(ball.vertices, ball.faces[upper], None, None),
            Piece(ball.vertices, ball.faces[~upper], None, None, continues=continues),
        ]
        mesh = joined_mesh(pieces)
        away = np.abs(mesh.normals - mesh.vertices)[mesh.is_used].max()
        assert away < most and (continues or away > 0.03), "by itself each half has a rim"


def test_no_primitive_of_many_is_lost(tmp_path: Path) -> None:
    """20,000 primitives in under a megabyte; trimesh's own scene drops a dozen of them."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    primitives = [{"attributes": {"POSITION": 0}, "indices": 1}] * 20_000
    order = np.arange(3, dtype=np.uint32)
    path = write_glb(
        tmp_path / "a.glb", [positions, order], meshes=[{"primitives": primitives}], nodes=[{"mesh": 0}], scenes=SCENE
    )
    assert path.stat().st_size < 1_000_000
    mesh = ldtrefl.load_mesh(path)
    assert len(mesh.faces) == len(mesh.parts) == 20_000
    assert mesh.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]


def test_a_material_of_many_pieces_has_one_picture(tmp_path: Path) -> None:
    picture = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.new("RGB", (4, 4), (9, 9, 9)))
    scene = trimesh.Scene()
    for k in range(3):
        sheet = trimesh.Trimesh([[k, 0, 0], [k + 1, 0, 0], [k, 1, 0]], [[0, 1, 2]], process=False)
        sheet.visual = trimesh.visual.TextureVisuals(uv=np.eye(3)[:, :2], material=picture)
        scene.add_geometry(sheet)
    scene.export(tmp_path / "a.glb")
    mesh = ldtrefl.load_mesh(tmp_path / "a.glb")
    assert len(mesh.parts) == 3 and all(picture_of(part) is picture_of(mesh.parts[0]) for part in mesh.parts)


@pytest.mark.parametrize("kind", ["obj", "ply"])
def test_a_sheet_modelled_twice_is_smooth_on_both_sides(tmp_path: Path, kind: str) -> None:
    """A roof of two slopes whose faces are there twice, wound both ways, with the same vertices."""
    vertices = [[-1, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 3, 0], [0, 3, 1], [1, 3, 0]]
    faces = [[0, 1, 4, 3], [0, 3, 4, 1], [1, 2, 5, 4], [1, 4, 5, 2]]
    path = tmp_path / f"a.{kind}"
    if kind == "obj":
        lines = [f"v {x} {y} {z}" for x, y, z in vertices]
        path.write_text("\n".join([*lines, *("f " + " ".join(str(k + 1) for k in face) for face in faces)]))
    else:
        points = (["float x", "float y", "float z"], [list(map(float, vertex)) for vertex in vertices])
        lists = (["list uchar int vertex_indices"], [[face] for face in faces])
        write_ply(path, "binary_little_endian", {"vertex": points, "face": lists})
    mesh = ldtrefl.load_mesh(path)
    corners, normals = mesh.vertices[mesh.faces], mesh.normals[mesh.faces]
    up = np.sign(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2])
    half = np.sqrt(0.5)
    slope = np.array([[-half, 0, half], [0, 0, 1], [half, 0, half]])  # left eaves, ridge, right eaves
    wanted = up[:, None, None] * slope[corners[..., 0].astype(int) + 1]
    np.testing.assert_allclose(normals, wanted, atol=1e-6)
