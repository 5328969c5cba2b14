"""Files of polygons become meshes of triangles of the right area, in the file's order."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import ldtrefl
from tests.mesh_writers import write_ply
from tests.scene.readers.test_polygons import ARROW, NOTCHED, SQUARE, TRIANGLE, areas


def write_mixed(path: Path) -> np.ndarray:
    """A notched pentagon, a triangle, an arrow and a square, written as ``path`` says; the polygons' areas."""
    points = [*NOTCHED, *TRIANGLE, *ARROW, *SQUARE]
    polygons = [[0, 1, 2, 3, 4], [5, 6, 7], [8, 9, 10, 11], [12, 13, 14, 15]]
    kind = path.name.split(".")[-1]
    if kind == "obj":
        lines = [f"v {x} {y} {z}" for x, y, z in points]
        lines += ["f " + " ".join(str(k + 1) for k in polygon) for polygon in polygons]
        path.write_text("\n".join(lines))
    elif kind == "off":
        lines = ["OFF", f"{len(points)} {len(polygons)} 0", *(f"{x} {y} {z}" for x, y, z in points)]
        lines += [" ".join(map(str, [len(polygon), *polygon])) for polygon in polygons]
        path.write_text("\n".join(lines))
    else:
        faces = [[polygon, 7] for polygon in polygons]
        properties = ["list uchar int vertex_indices", "uchar material"]
        vertices = (["float x", "float y", "float z"], [list(map(float, point)) for point in points])
        write_ply(path, path.name.split(".")[0], {"vertex": vertices, "face": (properties, faces)})
    return np.array([2.5, 0.5, 1.5, 1.0])


@pytest.mark.parametrize("name", ["a.obj", "a.off", "ascii.ply", "binary_little_endian.ply", "binary_big_endian.ply"])
def test_files_of_polygons_keep_areas_and_order(tmp_path: Path, name: str) -> None:
    wanted = write_mixed(tmp_path / name)
    mesh = ldtrefl.load_mesh(tmp_path / name)
    runs = np.split(mesh.faces, [3, 4, 6])
    found = [areas(mesh.vertices, run) for run in runs]
    np.testing.assert_allclose([area for area, _ in found], wanted)
    np.testing.assert_allclose([vector[2] for _, vector in found], wanted)


@pytest.mark.parametrize("name", ["a.obj", "a.off", "ascii.ply", "binary_little_endian.ply"])
def test_quads_alone_stand_in_order_too(tmp_path: Path, name: str) -> None:
    points = [[float(k), float(j), 0.0] for k in range(4) for j in range(2)]
    quads = [[0, 2, 3, 1], [2, 4, 5, 3], [4, 6, 7, 5]]
    path = tmp_path / name
    if name.endswith("ply"):
        vertices = (["float x", "float y", "float z"], points)
        write_ply(
            path,
            name.split(".", maxsplit=1)[0],
            {"vertex": vertices, "face": (["list uchar int vertex_indices"], [[q] for q in quads])},
        )
    elif name.endswith("obj"):
        path.write_text(
            "".join(f"v {x} {y} {z}\n" for x, y, z in points)
            + "".join(f"f {a + 1} {b + 1} {c + 1} {d + 1}\n" for a, b, c, d in quads)
        )
    else:
        path.write_text(
            "OFF\n8 3 0\n"
            + "".join(f"{x} {y} {z}\n" for x, y, z in points)
            + "".join(f"4 {a} {b} {c} {d}\n" for a, b, c, d in quads)
        )
    mesh = ldtrefl.load_mesh(path)
    middles = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    assert (np.floor(middles) == [0, 0, 1, 1, 2, 2]).all()


def test_relative_numbers_of_an_obj_count_from_where_they_stand(tmp_path: Path) -> None:
    square = "v 0 0 {0}\nv 1 0 {0}\nv 0 1 {0}\nf -3 -2 -1\n"
    (tmp_path / "a.obj").write_text("".join(square.format(z) for z in range(3)))
    mesh = ldtrefl.load_mesh(tmp_path / "a.obj")
    np.testing.assert_array_equal(mesh.vertices[mesh.faces][:, :, 2], [[0] * 3, [1] * 3, [2] * 3])


def test_a_byte_order_mark_hides_no_polygon_of_the_first_line(tmp_path: Path) -> None:
    square = "f 1 2 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
    for encoding in ("utf-8", "utf-8-sig"):
        (tmp_path / f"{encoding}.obj").write_text(square, encoding=encoding)
        mesh = ldtrefl.load_mesh(tmp_path / f"{encoding}.obj")
        np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [2, 3, 0]])


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


def loaded(folder: Path, text: str, **files: str | bytes) -> ldtrefl.Mesh:
    """The mesh of an OBJ file, with files beside it whose names end with what stands behind their last '_'."""
    for name, content in files.items():
        data = content.encode() if isinstance(content, str) else content
        (folder / ".".join(name.rsplit("_", 1))).write_bytes(data)
    (folder / "a.obj").write_bytes(text.encode())
    return ldtrefl.load_mesh(folder / "a.obj")


def said(caplog: pytest.LogCaptureFixture) -> list[str]:
    """What was logged, less the name of the file."""
    return [record.getMessage().partition(".obj: ")[2] for record in caplog.records]


TRIANGLE_TEXT = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def test_a_hard_edged_box_keeps_all_36_normals(tmp_path: Path) -> None:
    """Eight positions, six normals, and faces of four corners, as Blender writes it."""
    box = trimesh.creation.box()
    sides = [(axis, side) for axis in range(3) for side in (-1, 1)]
    lines = [f"v {x} {y} {z}" for x, y, z in box.vertices]
    lines += ["vn " + " ".join(str(side if k == axis else 0) for k in range(3)) for axis, side in sides]
    for number, (axis, side) in enumerate(sides, 1):
        corners = np.flatnonzero(box.vertices[:, axis] == side / 2)
        across = np.delete(box.vertices[corners], axis, axis=1)
        corners = corners[np.argsort(np.arctan2(across[:, 1], across[:, 0]))][:: side * (-1) ** axis]
        lines.append("f " + " ".join(f"{corner + 1}//{number}" for corner in corners))
    mesh = loaded(tmp_path, "\n".join(lines))
    assert mesh.faces.shape == (12, 3)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    np.testing.assert_array_equal(mesh.normals[mesh.faces], np.repeat(np.cross(b - a, c - a), 3, 0).reshape(12, 3, 3))


def test_all_that_lines_may_look_like(tmp_path: Path) -> None:
    """Marks, carriage returns, tabs, indents, comments behind statements, lines that go on, old ends of lines."""
    mesh = loaded(tmp_path, "\ufeff" + TRIANGLE_TEXT.replace(" ", "\t") + "  f 1 \\\r\n 2 \\\r\n3 # caf\u00e9\r\n")
    np.testing.assert_array_equal(mesh.vertices[mesh.faces[0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert len(loaded(tmp_path, (TRIANGLE_TEXT + "f 1 2 3\n").replace("\n", "\r")).faces) == 1
    assert len(loaded(tmp_path, "f 1/ 2/ 3/\n" + TRIANGLE_TEXT).faces) == 1


def test_relative_numbers_of_every_kind(tmp_path: Path) -> None:
    """Texture coordinates and normals, too, and beside absolute ones."""
    text = TRIANGLE_TEXT + "vt 0 0\nvt 0.5 0\nvt 0 0.25\nvn 0 0 1\nf -3/-3/-1 2/-2/1 -1/3/-1\nvt 9 9\n"
    mesh = loaded(tmp_path, text)
    assert mesh.uvs is not None
    np.testing.assert_array_equal(mesh.uvs[mesh.faces[0]], [[0, 0], [0.5, 0], [0, 0.25]])
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (3, 1)))


def test_colors_of_vertices_are_srgb(tmp_path: Path) -> None:
    """As Blender and MeshLab write them; some programs count to 255. A vertex without one is white."""
    text = "v 0 0 0 1 0 0.5\nv 1 0 0 0 1 0\nv 0 1 0\nf 1 2 3\n"
    wanted = [[1, 0, ((0.5 + 0.055) / 1.055) ** 2.4, 1], [0, 1, 0, 1], [1, 1, 1, 1]]
    mesh = loaded(tmp_path, text)
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors, wanted, atol=1e-6)
    mesh = loaded(tmp_path, text.replace("1 0 0.5", "255 0 127.5").replace(" 0 1 0\nv", " 0 255 0\nv"))
    np.testing.assert_allclose(mesh.colors, wanted, atol=1e-6)
    assert loaded(tmp_path, TRIANGLE_TEXT + "f 1 2 3\n").colors is None


def test_corners_keep_apart_what_only_texture_coordinates_part(tmp_path: Path) -> None:
    """A seam; without normals the surface is smooth across it."""
    text = "v 0 0 0\nv 0 1 0\nv 1 0 1\nv -1 0 1\nvt 0 0\nvt 1 0\nvt 0.5 1\n"
    mesh = loaded(tmp_path, text + "f 1/1 3/3 2/1\nf 1/2 2/2 4/3\n")
    assert mesh.uvs is not None
    np.testing.assert_array_equal(mesh.uvs[mesh.faces], [[[0, 0], [0.5, 1], [0, 0]], [[1, 0], [1, 0], [0.5, 1]]])
    edge = mesh.normals[mesh.faces][:, [0, 2, 1]]
    np.testing.assert_allclose(edge[0, 0], edge[1, 0], atol=1e-6)


def test_smoothing_off_is_flat_and_groups_end_at_their_borders(tmp_path: Path) -> None:
    roof = "v 0 0 0\nv 0 1 0\nv 1 0 -1\nv -1 0 -1\n"
    faces = ["f 1 3 2\n", "f 1 2 4\n"]
    smooth = loaded(tmp_path, roof + "".join(faces))
    np.testing.assert_allclose(smooth.normals[0], [0, 0, 1], atol=1e-6)
    for text in (f"s 1\n{faces[0]}s 2\n{faces[1]}",):
        mesh = loaded(tmp_path, roof + text)
        np.testing.assert_allclose(mesh.normals[mesh.faces[0]], np.tile([0.5**0.5, 0, 0.5**0.5], (3, 1)), atol=1e-6)
        np.testing.assert_allclose(mesh.normals[mesh.faces[1]], np.tile([-(0.5**0.5), 0, 0.5**0.5], (3, 1)), atol=1e-6)
    assert not loaded(tmp_path, roof + "s off\n" + "".join(faces)).normals.any(), "0: the facet's counts"


def test_materials_part_the_mesh_and_need_no_texture_coordinates(tmp_path: Path) -> None:
    """In the order in which they are first used; those of a file that is named last, and with blanks, count too."""
    text = f"{TRIANGLE_TEXT}usemtl red\ng one\nf 1 2 3\nusemtl blue one\ng two\nf 1 3 2\nusemtl red\nf 2 3 1\n"
    (tmp_path / "my a.mtl").write_text("newmtl blue one\nKd 0 0 1\nnewmtl red\nKd 1 0 0\n")
    mesh = loaded(tmp_path, text + "mtllib my a.mtl\n")
    assert [part.material.name for part in mesh.parts] == ["red", "blue one"]
    assert [part.material.base_color for part in mesh.parts] == [(1, 0, 0), (0, 0, 1)]
    assert [part.first_triangle for part in mesh.parts] == [0, 2]
    places = mesh.vertices[mesh.faces][:, :, :2] @ [1, 2]
    np.testing.assert_array_equal(places, [[0, 1, 2], [1, 2, 0], [0, 2, 1]])


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("usemtl a\nf 1 2 3\n", "not shown: materials, as the file names no MTL file: 'a'"),
        ("mtllib b.mtl\nusemtl a\nf 1 2 3\n", "not shown: the materials of 'b.mtl' (it is not beside the file)"),
        ("mtllib c.mtl\nusemtl a\nf 1 2 3\n", "not shown: materials that no MTL file has: 'a'"),
        ("f 1 2 3\nl 1 2\np 1\n", "not shown: points and lines (they have no surface)"),
        ("f 1 2 3\ncurv2 1 2\nhello\n", "not shown: curved surfaces"),
        ("f 1 2 3\nf 1 2\n", "not shown: 1 faces of fewer than three corners"),
        ("f 1/1 2/1 3/1\n", "not shown: texture coordinates of 3 corners (the file has only 0)"),
        ("vn 0 0 nan\nf 1//1 2//1 3//1\n", "not shown: normals that are not finite"),
    ],
)
def test_what_is_not_shown_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture, text: str, line: str) -> None:
    assert len(loaded(tmp_path, TRIANGLE_TEXT + text, c_mtl="newmtl z\n").faces) == 1
    assert line in said(caplog)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("f 1 2 9\n", "line 4: there is no vertex 9, there are 3"),
        ("f 1 2 -4\n", "line 4: there is no vertex -4"),
        ("f 1 2 0\n", "line 4: there is no vertex 0"),
        ("f 1 2 x\n", "line 4: should have corners such as 1, 1/2, 1//3 or 1/2/3, got 'f 1 2 x'"),
        ("# \\\n so\n\nv 1 2\nf 1 2 3\n", "line 7: should have at least 3 numbers, got 'v 1 2'"),
        ("v 1 2 3,5\n", "line 4: should have at least 3 numbers, got 'v 1 2 3,5'"),
        ("", "no line of the file is a face"),
        ("f 1 2\n", "every face has fewer than three corners"),
    ],
)
def test_what_is_wrong_is_a_line_with_its_number(tmp_path: Path, text: str, line: str) -> None:
    with pytest.raises(ldtrefl.InputError) as error:
        loaded(tmp_path, TRIANGLE_TEXT + text)
    assert str(error.value).startswith(str(tmp_path / "a.obj")) and line in str(error.value)


def test_blocks_of_lines_are_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Counts, materials and colours go on from block to block, and lines are cut at their ends alone."""
    rng = np.random.default_rng(0)
    lines = []
    for k in range(40):
        lines += [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in rng.uniform(size=(3, 3))]
        lines += [
            "vt 0 1",
            f"usemtl m{k % 3}",
            "f -3/-1 \\",
            f" -2/{k + 1} -1/-1",
            f"v 0 0 {k} 1 0 0" if k == 20 else "",
        ]
    text = "\n".join(lines)
    whole = loaded(tmp_path, text)
    for size in (1, 7, 100):
        monkeypatch.setattr("ldtrefl.scene.readers.obj_text.BLOCK", size)
        (tmp_path / "a.obj").unlink()
        mesh = loaded(tmp_path, text + "\n" * size)
        for name in ("vertices", "faces", "uvs", "colors", "normals"):
            np.testing.assert_array_equal(getattr(mesh, name), getattr(whole, name))
        assert [part.first_triangle for part in mesh.parts] == [part.first_triangle for part in whole.parts]
