"""Polygons become triangles of the right area, in the file's order, with the file's winding."""

from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.readers.polygons import triangles_of
from tests.mesh_writers import write_ply

NOTCHED = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 0.5, 0], [0, 2, 0]]
"""A square of 2 less a triangle of 1.5 cut from above: area 2.5."""
ARROW = [[0, 0, 0], [1, 0.5, 0], [2, 0, 0], [1, 2, 0]]
"""Four corners, the second points inwards: area 1.5."""
SQUARE = [[3, 0, 0], [4, 0, 0], [4, 1, 0], [3, 1, 0]]
TRIANGLE = [[5, 0, 0], [6, 0, 0], [5, 1, 0]]


def areas(points: np.ndarray, triangles: np.ndarray) -> tuple[float, np.ndarray]:
    """(sum of the triangles' areas, sum of their area vectors)."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a) / 2
    return float(np.linalg.norm(across, axis=1).sum()), across.sum(axis=0)


@pytest.mark.parametrize("turn", range(5))
@pytest.mark.parametrize("polygon, area", [(NOTCHED, 2.5), (ARROW, 1.5), (SQUARE, 1.0)])
def test_area_and_winding_whichever_corner_comes_first(polygon: list, area: float, turn: int) -> None:
    for points in (np.roll(polygon, turn, axis=0), np.roll(polygon, turn, axis=0)[::-1]):
        triangles = triangles_of(points.astype(float), np.array([len(points)]))
        unsigned, signed = areas(points, triangles)
        np.testing.assert_allclose(unsigned, area)
        np.testing.assert_allclose(np.abs(signed), [0, 0, area])
        assert set(triangles.reshape(-1)) == set(range(len(points)))


def test_random_stars_in_any_plane() -> None:
    """The area vector of a flat polygon is that of Newell's formula, however it is cut."""
    rng = np.random.default_rng(1)
    for count in (5, 6, 9, 50):
        angles = 2 * np.pi * (np.arange(count) + rng.uniform(0.1, 0.9, count)) / count
        flat = rng.uniform(0.1, 1.0, count) * np.stack([np.cos(angles), np.sin(angles)])
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        points = (turn[:, :2] @ flat).T + 1000.0
        triangles = triangles_of(points, np.array([count]))
        x, y = flat
        area = 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
        unsigned, signed = areas(points, triangles)
        assert len(triangles) == count - 2
        np.testing.assert_allclose(unsigned, area, rtol=1e-9)
        np.testing.assert_allclose(signed, area * np.cross(turn[:, 0], turn[:, 1]), atol=1e-9)


def test_corners_on_a_line_stay_joined_to_their_neighbours() -> None:
    """A neighbour may have a corner there: every edge of the polygon is an edge of one triangle."""
    points = np.array(
        [[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [1, 0.5, 0], [0, 2, 0]], float
    )
    triangles = triangles_of(points, np.array([8]))
    edges = [(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)]
    assert all(edges.count((k, (k + 1) % 8)) == 1 for k in range(8))
    np.testing.assert_allclose(areas(points, triangles)[0], 2.5)


@pytest.mark.parametrize(
    "points", [[[1, 1, 1]] * 6, [[k, 0, 0] for k in range(6)], [[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0]]]
)
def test_polygons_without_an_inside_still_give_their_triangles(points: list) -> None:
    assert triangles_of(np.array(points, float), np.array([len(points)])).shape == (len(points) - 2, 3)


def test_the_time_to_cut_polygons_is_bounded() -> None:
    """Refused by what is known before any is cut."""
    x = np.linspace(0, 1, 20_000)
    saw = np.stack([x, 0.1 * (np.arange(len(x)) % 2), 0 * x], 1)
    saw[[0, -1], 1] = 1.0
    with pytest.raises(ldtrefl.InputError, match="not convex have too many corners"):
        triangles_of(saw, np.array([len(saw)]))


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
