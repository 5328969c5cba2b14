"""Pieces of mesh files: placed by their nodes, with the normals and texture coordinates that the file gives."""

from pathlib import Path

import numpy as np
import trimesh

import ldtrefl
from tests.mesh_writers import write_glb
from tests.scene.readers.soft_box import MESH, SCENE, soft_box


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
