"""PLY files: what vertices, faces and their corners have arrives, as text and as bytes of either order."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

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


KINDS = ("ascii", "binary_little_endian", "binary_big_endian")
POINTS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
XYZ = ["float x", "float y", "float z"]
CORNERS = "list uchar int vertex_indices"


def square(path: Path, kind: str, more: list[str], values: list[list], **tables: tuple) -> ldtrefl.Mesh:
    """The mesh of a square, whose vertices have more properties."""
    rows = [point + value for point, value in zip(POINTS, values or [[]] * 4, strict=True)]
    faces = tables.pop("face", ([CORNERS], [[[0, 1, 2, 3]]]))
    return ldtrefl.load_mesh(write_ply(path, kind, {"vertex": (XYZ + more, rows), "face": faces, **tables}))


def linear(byte: int) -> float:
    """The linear value of a byte of sRGB, of those above the straight piece."""
    return ((byte / 255 + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize("kind", KINDS)
def test_colors_of_vertices(tmp_path: Path, kind: str) -> None:
    """Bytes are sRGB and floats linear."""
    names = [f"uchar {name}" for name in ("red", "green", "blue", "alpha")]
    colors = [[255, 0, 100, 51], [0, 255, 0, 255], [0, 0, 255, 255], [9 + 91, 100, 100, 0]]
    mesh = square(tmp_path / "a.ply", kind, names, colors)
    np.testing.assert_allclose(mesh.colors[0], [1, 0, linear(100), 0.2], atol=1e-6)
    np.testing.assert_allclose(mesh.colors[3], [linear(100)] * 3 + [0], atol=1e-6)
    mesh = square(
        tmp_path / "b.ply", kind, [f"float {name}" for name in ("red", "green", "blue")], [[0.5, 0.25, 2]] * 4
    )
    np.testing.assert_allclose(mesh.colors, [[0.5, 0.25, 2, 1]] * 4)
    mesh = square(
        tmp_path / "c.ply", kind, [f"ushort {name}" for name in ("red", "green", "blue")], [[65535, 0, 0]] * 4
    )
    np.testing.assert_allclose(mesh.colors, [[1, 0, 0, 1]] * 4)


@pytest.mark.parametrize("kind", KINDS)
def test_colors_of_faces_end_at_their_edges(tmp_path: Path, kind: str) -> None:
    names = [CORNERS, *(f"uchar {name}" for name in ("red", "green", "blue"))]
    faces = (names, [[[0, 1, 2], 255, 0, 0], [[0, 2, 3], 0, 0, 255]])
    mesh = square(tmp_path / "a.ply", kind, ["float nx", "float ny", "float nz"], [[0.0, 0.6, 0.8]] * 4, face=faces)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], np.array(POINTS)[[[0, 1, 2], [0, 2, 3]]])
    np.testing.assert_array_equal(mesh.colors[mesh.faces], [[[1, 0, 0, 1]] * 3, [[0, 0, 1, 1]] * 3])
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0.6, 0.8], (6, 1)))


@pytest.mark.parametrize("names", ["s t", "u v", "texture_u texture_v"])
@pytest.mark.parametrize("kind", KINDS)
def test_texture_coordinates_of_vertices_and_their_picture(tmp_path: Path, kind: str, names: str) -> None:
    Image.new("RGB", (2, 2), (9, 8, 7)).save(tmp_path / "my wood.png")
    uvs = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]
    path = tmp_path / "a.ply"
    square(path, kind, [f"float {name}" for name in names.split()], uvs)
    path.write_bytes(path.read_bytes().replace(b" 1.0\n", b" 1.0\ncomment TextureFile my wood.png\n", 1))
    mesh = ldtrefl.load_mesh(path)
    np.testing.assert_array_equal(mesh.uvs, uvs)
    texture = mesh.parts[0].material.base_texture
    assert texture is not None and (texture.picture.pixels == [9, 8, 7]).all()


def test_faces_of_several_pictures(tmp_path: Path) -> None:
    """As MeshLab writes them: each face has a number."""
    for k in range(2):
        Image.new("RGB", (2, 2), (k, k, k)).save(tmp_path / f"{k}.png")
    names = [CORNERS, "list uchar float texcoord", "int texnumber"]
    faces = (names, [[[0, 1, 2], [0.0] * 6, 1], [[0, 2, 3], [0.5] * 6, 0], [[0, 2, 3], [0.0] * 6, 1]])
    path = tmp_path / "a.ply"
    square(path, "binary_little_endian", [], [], face=faces)
    comments = b" 1.0\ncomment TextureFile 0.png\ncomment TextureFile 1.png\n"
    path.write_bytes(path.read_bytes().replace(b" 1.0\n", comments, 1))
    mesh = ldtrefl.load_mesh(path)
    assert [part.first_triangle for part in mesh.parts] == [0, 1]
    assert [part.material.base_texture.picture.pixels[0, 0, 0] for part in mesh.parts] == [0, 1]
    np.testing.assert_array_equal(mesh.uvs[mesh.faces[0]], [[0.5] * 2] * 3)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces[1]], np.array(POINTS)[[0, 1, 2]])


def test_strips_are_triangles(tmp_path: Path) -> None:
    """As in the Stanford repository: every second triangle of a strip is wound the other way; -1 ends one."""
    strips = (["list int int vertex_indices"], [[[0, 1, 3, 2, -1, 0, 1, 2]], [[1, 2, 3]]])
    tables = {"vertex": (XYZ, POINTS), "tristrips": strips}
    for kind in KINDS:
        mesh = ldtrefl.load_mesh(write_ply(tmp_path / f"{kind}.ply", kind, tables))
        np.testing.assert_array_equal(mesh.faces, [[0, 1, 3], [3, 1, 2], [0, 1, 2], [1, 2, 3]])


def test_what_is_not_shown_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    extra = (["int first", "int second"], [[0, 1]])
    square(tmp_path / "a.ply", "ascii", ["float confidence", "uchar red"], [[0.5, 1]] * 4, edge=extra)
    lines = [record.getMessage().partition(".ply: ")[2] for record in caplog.records]
    assert lines == ["not shown: vertex properties: confidence, red", "not shown: the element 'edge'"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_wrong_is_a_line(tmp_path: Path, kind: str) -> None:
    with pytest.raises(ldtrefl.InputError, match=r"a\.ply: face 0 has vertex 7, allowed are 0 to 3"):
        square(tmp_path / "a.ply", kind, [], [], face=([CORNERS], [[[0, 1, 7]]]))
    with pytest.raises(ldtrefl.InputError, match=r"b\.ply: the mesh has no triangles: .* 'face'"):
        ldtrefl.load_mesh(write_ply(tmp_path / "b.ply", kind, {"vertex": (XYZ, POINTS)}))
    with pytest.raises(ldtrefl.InputError, match=r"c\.ply: the mesh has no triangles: it is a cloud of points"):
        square(tmp_path / "c.ply", kind, [], [], face=([CORNERS], []))
    with pytest.raises(ldtrefl.InputError, match=r"d\.ply: .*'vertex' with properties x, y and z"):
        ldtrefl.load_mesh(write_ply(tmp_path / "d.ply", kind, {"face": ([CORNERS], [])}))
