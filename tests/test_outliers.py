"""Meshes of very different sizes in one: float64 decides what is right."""

import subprocess
import sys

import numpy as np
import pytest
from stress_cases.judge import Truth

import ldtrefl
from ldtrefl import grid_build, shapes

KNOT = {"segments": [64, 16]}


def with_outlier(kind: str, size: float) -> ldtrefl.Mesh:
    """A knot of size 2 and one triangle: far away and large, below it without end, or far away and small."""
    corners = {
        "beside": [[size, 0, 0], [size, size, 0], [size, 0, size]],
        "ground": [[-size, -size, -1.2], [size, -size, -1.2], [0, size, -1.2]],
        "dust": [[size, 0, 0], [size + 0.1, 0.1, 0], [size, 0, 0.1]],
    }[kind]
    knot = shapes.make("torus_knot", KNOT)
    n = len(knot.vertices)
    return ldtrefl.Mesh(np.vstack([knot.vertices, corners]), np.vstack([knot.faces, [[n, n + 1, n + 2]]]))


def brute_force(mesh: ldtrefl.Mesh, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First hits by float64 from the rays' own origins: t in lengths of the direction, and triangles."""
    truth = Truth(mesh)
    corners = mesh.vertices[mesh.faces]
    truth._a, truth._u, truth._v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return truth._by_force(origins.astype(float), directions.astype(float))


@pytest.mark.parametrize("kind", ["beside", "ground", "dust"])
@pytest.mark.parametrize("size", [1e1, 1e2, 1e3, 1e4, 1e5, 1e6])
def test_one_triangle_far_away_changes_no_answer(kind: str, size: float) -> None:
    """Rays beside the knot, and rays from beyond the outlier to the knot, to a ten-thousandth of the knot's size."""
    mesh = with_outlier(kind, size)
    rng = np.random.default_rng(int(size))
    around = rng.normal(size=(1500, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    for distance in (2.0, 2.0 * size):
        origins = (distance * around).astype(np.float32)
        directions = (rng.uniform(-1, 1, around.shape) - origins).astype(np.float32)
        true_t, true_triangle = brute_force(mesh, origins, directions)
        assert (true_triangle >= 0).sum() > 500
        for trace in (
            ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact").trace,
            ldtrefl.peel(mesh.vertices, mesh.faces).trace,
            ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace,
        ):
            hits = trace(origins, directions)
            np.testing.assert_array_equal(hits.triangle >= 0, true_triangle >= 0)
            hit = true_triangle >= 0
            length = np.linalg.norm(directions[hit].astype(float), axis=1)
            error = np.abs(hits.t[hit] - true_t[hit]) * length
            # A float32 distance is itself rounded.
            assert (error <= 1e-4 + 2.4e-7 * true_t[hit] * length).all(), f"off by {error.max()}"
            same = hits.triangle[hit] == true_triangle[hit]
            assert (~same).sum() <= 3  # a ray may meet the edge between two


def test_an_ordinary_mesh_has_no_strays() -> None:
    for name in shapes.names():
        mesh = shapes.make(name)
        assert len(mesh.strays) == 0 and mesh.bulk is mesh.bounds
    assert with_outlier("dust", 1e3).strays.tolist() == [2 * 64 * 16]


def city(count: int) -> tuple[ldtrefl.Mesh, np.ndarray, np.ndarray]:
    """Boxes of sizes over six decades, anywhere: the mesh, (n,) half sides and (n, 3) middles."""
    rng = np.random.default_rng(0)
    half, middle = 10.0 ** rng.uniform(-3, 3, count), rng.uniform(-2000, 2000, (count, 3))
    box = shapes.make("box")
    vertices = (box.vertices * half[:, None, None] + middle[:, None]).reshape(-1, 3)
    faces = (box.faces + len(box.vertices) * np.arange(count)[:, None, None]).reshape(-1, 3)
    return ldtrefl.Mesh(vertices, faces), half, middle


def distance_to_boxes(half: np.ndarray, middle: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n,) first hits by slab tests in float64, in lengths of each direction."""
    first = []
    for o, d in zip(origins.astype(float), directions.astype(float), strict=True):
        a, b = (middle - half[:, None] - o) / d, (middle + half[:, None] - o) / d
        enter, leave = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
        t = np.where(enter >= 0, enter, leave)
        first.append(np.where((enter <= leave) & (leave >= 0), t, np.inf).min())
    return np.array(first)


def test_a_city_of_boxes_of_sizes_over_six_decades() -> None:
    """10,000 boxes in one mesh: hits are right but for rays within four ten-millionths of the city of an edge."""
    mesh, half, middle = city(10_000)
    size = float((mesh.bounds[1] - mesh.bounds[0]).max())
    rng = np.random.default_rng(3)
    picked = rng.integers(0, len(half), 500)
    around = rng.normal(size=(500, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    reach = half[picked, None]
    origins = (middle[picked] + around * reach * 10.0 ** rng.uniform(0.5, 2, (500, 1))).astype(np.float32)
    directions = (middle[picked] + rng.uniform(-1.2, 1.2, (500, 3)) * reach - origins).astype(np.float32)
    length = np.linalg.norm(directions.astype(float), axis=1)
    true_t = distance_to_boxes(half, middle, origins, directions) * length
    aside = rng.normal(size=(40, 3))
    aside *= 4e-7 * size / np.linalg.norm(aside, axis=1, keepdims=True)
    for trace in (
        ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact").trace,
        ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace,
    ):
        t = trace(origins, directions).t * length
        finite = np.isfinite(t) & np.isfinite(true_t)
        wrong = np.isfinite(t) != np.isfinite(true_t)
        wrong[finite] = np.abs(t[finite] - true_t[finite]) > 4e-7 * size + 2.4e-7 * true_t[finite]
        assert finite.sum() > 400
        for ray in np.flatnonzero(wrong):
            beside = distance_to_boxes(
                half, middle, origins[ray] + aside, np.broadcast_to(directions[ray], aside.shape)
            )
            beside = beside * length[ray]
            slack = 2e-6 * size
            assert ((np.isinf(beside) & np.isinf(t[ray])) | (np.abs(beside - t[ray]) < slack)).any(), ray


def test_doubted_hits_come_to_an_end() -> None:
    """Past a patch's back a search goes on by the horizon; where that is less than t's rounding, it must end too."""
    program = """
import numpy as np, ldtrefl
from ldtrefl import shapes
knot = shapes.make("torus_knot", {"segments": [2000, 125]})
maps = ldtrefl.peel(knot.vertices, knot.faces)
assert maps.grid.patches and maps.grid.view.front != 0.0
maps.grid.view.horizon = 0.0
rng = np.random.default_rng(0)
inside = knot.vertices[rng.integers(0, len(knot.vertices), 50_000)] * 0.999
hits = maps.trace(inside, rng.normal(size=inside.shape))
print((hits.triangle >= 0).sum())
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 10_000


def test_a_grid_with_too_many_records_becomes_coarser(monkeypatch: pytest.MonkeyPatch) -> None:
    """Triangles as large as their mesh lie in thousands of cells each; the answers stay."""
    rng = np.random.default_rng(0)
    vertices, faces = rng.uniform(-1, 1, (3000, 3)), np.arange(3000).reshape(-1, 3)
    origins, directions = rng.normal(size=(500, 3)), rng.normal(size=(500, 3))
    fine = ldtrefl.peel(vertices, faces)
    monkeypatch.setattr(grid_build, "MOST_RECORDS", fine.grid.records // 3)
    coarse = ldtrefl.peel(vertices, faces)
    assert coarse.grid.records <= fine.grid.records // 3 and max(coarse.grid.view.cells) < max(fine.grid.view.cells)
    np.testing.assert_array_equal(coarse.trace(origins, directions).triangle, fine.trace(origins, directions).triangle)
    monkeypatch.setattr(grid_build, "MOST_RECORDS", 10)
    with pytest.raises(ldtrefl.InputError, match="the mesh has 1000 triangles, too many to search"):
        ldtrefl.peel(vertices, faces)


def test_more_triangles_than_an_int32_numbers_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ldtrefl.device_scene.MOST_NUMBERS", 100)
    camera = ldtrefl.Camera(eye=(0, -5, 0), look_at=(0, 0, 0), width=4, height=4)
    boxes = tuple(ldtrefl.Object(shape="box") for _ in range(9))
    ldtrefl.render(ldtrefl.Scene(camera=camera, objects=boxes[:4]))
    with pytest.raises(ldtrefl.InputError, match="the objects have more than 100 vertices, instances counted in"):
        ldtrefl.render(ldtrefl.Scene(camera=camera, objects=boxes))
