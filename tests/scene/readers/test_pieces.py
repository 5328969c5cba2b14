"""Pieces of mesh files: placed by their nodes, with the normals and texture coordinates that the file gives."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl
from tests.mesh_writers import write_glb
from tests.scene.readers.soft_box import MESH, SCENE, soft_box


@pytest.mark.parametrize("has_uvs", [True, False])
@pytest.mark.parametrize("is_quads", [True, False])
def test_an_obj_keeps_what_each_corner_has(tmp_path: Path, is_quads: bool, has_uvs: bool) -> None:
    """Corners share positions, but neither texture coordinates nor normals."""
    rng = np.random.default_rng(0)
    box = trimesh.creation.box()
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6]]) if is_quads else box.faces
    size = faces.shape[1]
    uvs, normals = rng.uniform(0, 1, (faces.size, 2)).round(4), rng.normal(size=(faces.size, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).round(4)
    lines = [f"v {x} {y} {z}" for x, y, z in box.vertices]
    lines += [f"vt {u} {v}" for u, v in uvs] if has_uvs else []
    lines += [f"vn {x} {y} {z}" for x, y, z in normals]
    for k, face in enumerate(faces):
        corners = [size * k + j + 1 for j in range(size)]
        words = [f"{v + 1}/{c if has_uvs else ''}/{c}" for v, c in zip(face, corners, strict=True)]
        lines.append("f " + " ".join(words))
    (tmp_path / "a.obj").write_text("\n".join(lines))
    mesh = ldtrefl.load_mesh(tmp_path / "a.obj")
    cut = np.array([[0, 1, 2], [2, 3, 0]] if is_quads else [[0, 1, 2]])
    chosen = (size * np.arange(len(faces))[:, None, None] + cut).reshape(-1, 3)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], box.vertices[faces.reshape(-1)[chosen]])
    np.testing.assert_allclose(mesh.normals[mesh.faces], normals[chosen], atol=1e-3)
    assert (mesh.uvs is not None) == has_uvs
    if mesh.uvs is not None:
        np.testing.assert_allclose(mesh.uvs[mesh.faces], uvs[chosen], atol=1e-6)


def test_an_obj_may_have_a_mark_and_comments_of_any_letters(tmp_path: Path) -> None:
    text = "# caf\u00e9\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nv 1 1 0\r\nf 1 2 4 3 # d\u00e9j\u00e0 vu\r\n"
    for encoding in ("latin-1", "utf-8", "utf-8-sig"):
        (tmp_path / "a.obj").write_bytes(text.encode(encoding))
        assert len(ldtrefl.load_mesh(tmp_path / "a.obj").faces) == 2


def test_nodes_place_normals_and_winding(tmp_path: Path) -> None:
    """A stretched and turned copy, and a mirrored one inside a moved node: the sphere's normals follow its surface."""
    ball = trimesh.creation.icosphere(3)
    positions, order = ball.vertices.astype(np.float32), ball.faces.astype(np.uint32).reshape(-1)
    half = float(np.sqrt(0.5))
    nodes = [
        {"mesh": 0, "scale": [3, 1, 0.5], "rotation": [0, 0, half, half]},
        {"children": [2], "translation": [10, 0, 0], "scale": [2, 2, 2]},
        {"mesh": 0, "scale": [-1, 1, 1], "translation": [1, 0, 0]},
    ]
    path = tmp_path / "a.glb"
    write_glb(path, [positions, positions, order], meshes=MESH, nodes=nodes, scenes=[{"nodes": [0, 1]}])
    mesh = ldtrefl.load_mesh(path)
    count = len(positions)
    # A quarter turn about z takes the stretched x to y: the ellipsoid x^2 + y^2 / 9 + 4 z^2 = 1 and its gradient.
    wide, small = (slice(0, count), slice(count, None)) if mesh.bounds[1, 0] > 5 else (None, None)
    if np.abs(mesh.vertices[:count, 0]).max() > 5:
        wide, small = small, wide
    gradient = mesh.vertices[wide] * [1, 1 / 9, 4]
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(mesh.normals[wide], gradient, atol=1e-5)
    outward = mesh.vertices[small] - [12, 0, 0]
    np.testing.assert_allclose(mesh.normals[small], outward / 2, atol=1e-5)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    facets = np.cross(b - a, c - a)
    assert ((facets * mesh.normals[mesh.faces].sum(axis=1)).sum(axis=1) > 0).all()


def test_normals_that_are_none_are_undefined(tmp_path: Path) -> None:
    """NaN and 0 become 0, for which shading takes the facet's; long ones become unit vectors."""
    positions, normals, order = soft_box()
    spoilt = normals.copy()
    spoilt[0], spoilt[1], spoilt[2] = np.nan, 0.0, 5.0 * spoilt[2]
    tree = {"meshes": MESH, "nodes": [{"mesh": 0}], "scenes": SCENE}
    mesh = ldtrefl.load_mesh(write_glb(tmp_path / "a.glb", [positions, spoilt, order], **tree))
    np.testing.assert_allclose(
        mesh.normals[mesh.faces].reshape(-1, 3)[:4], [[0] * 3, [0] * 3, *normals[2:4]], atol=1e-6
    )
