"""Files of polygons become meshes of triangles of the right area, in the file's order."""

from pathlib import Path

import numpy as np
import pytest

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
