"""PLY files of polygons keep what their corners have."""

from pathlib import Path

import numpy as np

import ldtrefl
from tests.mesh_writers import write_ply
from tests.scene.readers.soft_box import soft_box


def test_corners_of_ply_polygons_keep_their_texture_coordinates_and_normals(tmp_path: Path) -> None:
    """Two squares share an edge but not its texture coordinates."""
    points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]]
    normals = np.random.default_rng(2).normal(size=(6, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = [[0, 1, 2, 3], [1, 4, 5, 2]]
    uvs = np.random.default_rng(3).uniform(0, 1, (2, 4, 2)).round(3)
    vertices = ([f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")], np.hstack([points, normals]).tolist())
    rows = [[face, uv.reshape(-1).tolist()] for face, uv in zip(faces, uvs, strict=True)]
    lists = ["list uchar int vertex_indices", "list uchar float texcoord"]
    for kind in ("ascii", "binary_little_endian"):
        mesh = ldtrefl.load_mesh(write_ply(tmp_path / f"{kind}.ply", kind, {"vertex": vertices, "face": (lists, rows)}))
        assert mesh.uvs is not None
        for polygon in range(2):
            for corner in mesh.faces[2 * polygon : 2 * polygon + 2].reshape(-1):
                place = int(np.flatnonzero((points == mesh.vertices[corner]).all(axis=1))[0])
                np.testing.assert_allclose(mesh.uvs[corner], uvs[polygon, faces[polygon].index(place)], atol=1e-6)
                np.testing.assert_allclose(mesh.normals[corner], normals[place], atol=1e-6)


def test_a_ply_keeps_the_normals_of_all_36_corners(tmp_path: Path) -> None:
    positions, normals, order = soft_box()
    vertices = (
        [f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")],
        np.hstack([positions, normals]).tolist(),
    )
    faces = (["list uchar int vertex_indices"], [[row] for row in order.reshape(-1, 3).tolist()])
    for kind in ("ascii", "binary_little_endian"):
        mesh = ldtrefl.load_mesh(write_ply(tmp_path / f"{kind}.ply", kind, {"vertex": vertices, "face": faces}))
        np.testing.assert_allclose(mesh.normals[mesh.faces].reshape(-1, 3), normals, atol=1e-7)
