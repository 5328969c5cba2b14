"""What mesh files store arrives, corner for corner; what takes too much is refused before it is taken."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl
from tests.conftest import REAL_MESHES
from tests.mesh_writers import write_glb
from tests.scene.readers.mutated_files import ending_of
from tests.scene.readers.soft_box import MESH, SCENE, soft_box


def test_a_glb_keeps_the_normals_of_all_36_corners(tmp_path: Path) -> None:
    positions, normals, order = soft_box()
    path = write_glb(tmp_path / "a.glb", [positions, normals, order], meshes=MESH, nodes=[{"mesh": 0}], scenes=SCENE)
    mesh = ldtrefl.load_mesh(path)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces].reshape(-1, 3), positions)
    np.testing.assert_array_equal(mesh.normals[mesh.faces].reshape(-1, 3), normals)


def test_a_folder_or_pipe_is_no_mesh(tmp_path: Path) -> None:
    (tmp_path / "a.ply").mkdir()
    with pytest.raises(ldtrefl.InputError, match=r"a\.ply: not a file"):
        ldtrefl.load_mesh(tmp_path / "a.ply")


def test_vertices_that_are_not_finite_are_refused_used_or_not(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n")
    with pytest.raises(ldtrefl.InputError, match=r"a\.obj: vertex 3 is not finite"):
        ldtrefl.load_mesh(tmp_path / "a.obj")
    with pytest.raises(ldtrefl.InputError, match="vertex 3 is not finite"):
        ldtrefl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.inf, 0, 0]], [[0, 1, 2]])
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    with pytest.raises(ldtrefl.InputError, match=r"b\.obj"):
        ldtrefl.load_mesh(tmp_path / "b.obj")


@pytest.mark.parametrize("name", REAL_MESHES)
def test_real_meshes_load(real_mesh: Callable, name: str) -> None:
    mesh = real_mesh(name)
    assert mesh.faces.max() < len(mesh.vertices)
    lengths = np.linalg.norm(mesh.normals, axis=1)
    assert ((np.abs(lengths - 1) < 1e-3) | (lengths == 0)).all()
    assert (lengths[mesh.is_used] == 0).mean() < 0.01, "vertices of triangles without area alone have no normal"
    assert (mesh.uvs is not None) == any(part.material.base_texture is not None for part in mesh.parts)


@pytest.mark.parametrize("kind", ["ply", "obj", "stl", "off", "glb"])
def test_every_common_format(tmp_path: Path, kind: str) -> None:
    options = {"include_normals": True} if kind == "glb" else {}  # flat without any
    trimesh.creation.icosphere(2).export(tmp_path / f"ball.{kind}", **options)
    mesh = ldtrefl.load_mesh(tmp_path / f"ball.{kind}")
    assert len(mesh.faces) == 320
    np.testing.assert_allclose(mesh.bounds, [[-1, -1, -1], [1, 1, 1]], atol=0.02)
    if kind == "stl":
        assert not mesh.normals.any(), "facets"
    else:
        np.testing.assert_allclose(mesh.normals, mesh.vertices, atol=0.05)  # smooth, whether corners are shared or not


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "ball.ply"
    trimesh.creation.icosphere(1).export(path)
    first = ldtrefl.load_mesh(path)
    assert ldtrefl.load_mesh(path) is first
    trimesh.creation.icosphere(2).export(path)
    assert len(ldtrefl.load_mesh(path).faces) == 320


def test_damaged_files_are_a_mesh_or_a_line(tmp_path: Path) -> None:
    """A few of those that the script of ``mutated_files.py`` makes by the thousand."""
    (tmp_path / "inside").mkdir()
    endings = {ending_of(tmp_path / "inside", number) for number in range(180)}
    assert endings == {"a mesh", "a line"}


@pytest.mark.parametrize(("alpha", "is_said"), [(255, False), (254, True)])
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.off", "COFF\n3 1 0\n0 0 0 255 0 0 {0}\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n3 0 1 2\n"),
        ("a.obj", "v 0 0 0 255 0 0 {0}\nv 1 0 0 255 0 0 255\nv 0 1 0 255 0 0 255\nf 1 2 3\n"),
    ],
)
def test_alpha_that_counts_for_nothing_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, name: str, text: str, alpha: int, is_said: bool
) -> None:
    (tmp_path / name).write_text(text.format(alpha))
    mesh = ldtrefl.load_mesh(tmp_path / name)
    np.testing.assert_allclose(mesh.colors[:, 3], [alpha / 255, 1, 1], rtol=1e-6)
    assert ("not shown: alpha of its colours" in caplog.text) == is_said
