"""Peeling: no cracks, any depth, known layer counts, the same bits for any number of threads."""

import itertools
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from tests.conftest import CLOSED_MESHES

CLOSED_SHAPES = ("box", "bowl", "genus3", "gyroid", "hollow_box", "room", "sphere", "torus", "torus_knot", "wires")

MEAN_LAYERS = {
    # Mean surface crossings of the rays of a 128 x 128 grid that hit, along x, y and z: from the meshes' own listing,
    # made by another program.
    "armadillo.ply": (2.91, 2.81, 2.16),
    "happy_buddha.ply": (2.85, 4.84, 2.33),
    "lucy.ply": (2.98, 2.47, 4.33),
    "bunny_open.ply": (2.23, 2.44, 2.06),
    "boot.ply": (3.04, 2.41, 2.44),
    "teapot.ply": (4.36, 4.09, 3.86),
    "cycloidal_drive.ply": (10.19, 10.32, 7.95),
    "mosquito_in_amber.ply": (2.40, 2.50, 2.49),
    "sheen_chair.glb": (3.52, 2.58, 2.51),
    "dish_with_olives.glb": (6.18, 6.05, 6.27),
    "spot.glb": (2.30, 2.09, 2.34),
}


def odd_texels(maps: ldtrefl.LayeredDepthTexture) -> int:
    assert maps.fragment_count > 0, "of nothing all counts are even"
    return sum(int((maps.counts(axis) % 2).sum()) for axis in range(3))


@pytest.mark.parametrize("resolution", [17, 64, 256])
@pytest.mark.parametrize("name", [*CLOSED_SHAPES, *CLOSED_MESHES])
def test_closed_meshes_have_even_counts(mesh_or_shape: Callable, name: str, resolution: int) -> None:
    mesh = mesh_or_shape(name)
    assert odd_texels(ldtrefl.peel(mesh.vertices, mesh.faces, resolution=resolution)) == 0


def test_random_closed_meshes_have_even_counts() -> None:
    """Spheres crumpled at random, and vertices put exactly on texel centres, corners and edges."""
    rng = np.random.default_rng(5)
    ball = shapes.make("sphere", {"segments": [24, 12]})
    _, inverse = np.unique(ball.vertices, axis=0, return_inverse=True)
    inverse = inverse.reshape(-1)
    for trial in range(20):
        moved = ball.vertices + rng.normal(scale=0.3, size=(inverse.max() + 1, 3))[inverse]
        if trial % 2:
            moved = np.round(moved * 16) / 16
        assert odd_texels(ldtrefl.peel(moved, ball.faces, resolution=int(rng.integers(16, 100)))) == 0


@pytest.mark.parametrize("name", sorted(MEAN_LAYERS))
def test_layers_of_real_meshes(real_mesh: Callable, name: str) -> None:
    mesh = real_mesh(name)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=128)
    means = [maps.counts(axis)[maps.counts(axis) > 0].mean() for axis in range(3)]
    np.testing.assert_allclose(means, MEAN_LAYERS[name], rtol=0.03)


def test_convex_objects_have_one_layer_and_shells_as_many_as_there_are() -> None:
    ball = shapes.make("sphere", {"segments": [48, 24]})
    assert set(ldtrefl.peel(ball.vertices, ball.faces, resolution=64).layers().values()) == {1}
    scales = np.linspace(0.5, 1.0, 40)
    vertices = np.concatenate([s * ball.vertices for s in scales])
    faces = np.concatenate([ball.faces + i * len(ball.vertices) for i in range(len(scales))])
    maps = ldtrefl.peel(vertices, faces, resolution=64)
    assert set(maps.layers().values()) == {40}
    assert maps.counts(0).max() == 80


def test_texels_are_sorted_by_depth_then_triangle() -> None:
    """Random triangles stacked hundreds deep, many with equal depths: long texels go through heap sort."""
    rng = np.random.default_rng(1)
    height = np.repeat(rng.integers(0, 60, 300) / 30.0, 3)
    xy = np.tile(np.array([[-1, -1], [3, -1], [-1, 3]], float), (300, 1))
    maps = ldtrefl.peel(np.column_stack([xy, height]), np.arange(900).reshape(-1, 3), resolution=16)
    start, depth, reference = (x.numpy() for x in (maps.start, maps.depth, maps.reference))
    assert np.diff(start).max() == 300
    for first, end in itertools.pairwise(start):
        order = np.lexsort((reference[first:end], depth[first:end]))
        np.testing.assert_array_equal(order, np.arange(end - first))


def test_depths_agree_with_the_triangles() -> None:
    """Every fragment lies on its triangle's plane at its texel's centre."""
    mesh = shapes.make("torus_knot", {"segments": [120, 24]})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=64)
    start, depth, reference = (x.numpy() for x in (maps.start, maps.depth, maps.reference))
    points = mesh.unit_vertices.astype(float) * maps.frame.scale + maps.frame.offset
    for axis in range(3):
        rows, columns = maps.frame.map_shape(axis)
        first = maps.frame.first_texels[axis]
        span = slice(start[first], start[first + rows * columns])
        texel = np.repeat(np.arange(rows * columns), maps.counts(axis).ravel())
        a, b, c = np.moveaxis(points[mesh.faces[reference[span] >> 1]], 1, 0)
        normal = np.cross(b - a, c - a)
        u, v = (axis + 1) % 3, (axis + 2) % 3
        offset = (texel % columns + 0.5 - a[:, u]) * normal[:, u] + (texel // columns + 0.5 - a[:, v]) * normal[:, v]
        facing = np.abs(normal[:, axis]) > 0.3 * np.linalg.norm(normal, axis=1)
        expected = a[:, axis] - offset / np.where(facing, normal[:, axis], 1.0)
        np.testing.assert_allclose(depth[span][facing], expected[facing], atol=2e-3)
        assert ((reference[span] & 1) == (normal[:, axis] > 0)).all()


def test_same_bits_for_any_number_of_threads() -> None:
    mesh = shapes.make("torus_knot")
    made = []
    for threads in (1, 2, 5):
        ldtrefl.set_threads(threads)
        maps = ldtrefl.peel(mesh.vertices, mesh.faces)
        made.append([x.numpy().copy() for x in (maps.start, maps.depth, maps.reference)])
    for other in made[1:]:
        for a, b in zip(made[0], other, strict=True):
            np.testing.assert_array_equal(a, b)


def test_flat_tiny_and_far_meshes() -> None:
    triangle = np.array([[0, 1, 2]])
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    for scale in (1e-6, 1.0, 1e6):
        for offset in (0.0, 1e6 * scale):
            maps = ldtrefl.peel(corners * scale + offset, triangle, resolution=32)
            assert maps.frame.size == (32, 32, 1)
            origin = np.array([[0.2 * scale + offset, 0.3 * scale + offset, 5 * scale + offset]])
            hit = maps.trace(origin, [[0, 0, -1]])
            assert hit.t[0] == pytest.approx(5 * scale, rel=0.1 if offset else 1e-3)
    point = ldtrefl.peel(np.zeros((3, 3)), triangle)
    assert point.fragment_count == 0
    assert np.isposinf(point.trace([[0, 0, -1]], [[0, 0, 1]]).t).all()


def test_save_and_load_round_trip(tmp_path: Path) -> None:
    mesh = shapes.make("genus3", {"grid": 32})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=48)
    maps.save(tmp_path / "maps.npz")
    again = ldtrefl.LayeredDepthTexture.load(tmp_path / "maps.npz")
    assert again.frame == maps.frame
    for name in ("start", "depth", "reference"):
        np.testing.assert_array_equal(getattr(again, name).numpy(), getattr(maps, name).numpy())
    rays = np.array([[0, 0, 3]], np.float32), np.array([[0.1, 0.1, -1]], np.float32)
    assert again.trace(*rays).t == maps.trace(*rays).t
    assert [path.name for path in tmp_path.iterdir()] == ["maps.npz"]


def test_damaged_maps_are_refused(tmp_path: Path) -> None:
    mesh = shapes.make("box")
    path = tmp_path / "maps.npz"
    ldtrefl.peel(mesh.vertices, mesh.faces, resolution=16).save(path)
    whole = path.read_bytes()
    for length in range(0, len(whole), 97):
        path.write_bytes(whole[:length])
        with pytest.raises(ldtrefl.InputError, match=r"maps\.npz: not a layered depth texture that can be read"):
            ldtrefl.LayeredDepthTexture.load(path)
    path.write_bytes(whole)
    stored = dict(np.load(path))
    stored["reference"] = stored["reference"] + 10**6
    np.savez(path, **stored)
    with pytest.raises(ldtrefl.InputError, match="damaged"):
        ldtrefl.LayeredDepthTexture.load(path)
    with pytest.raises(ldtrefl.InputError, match=r"none\.npz: .*No such file"):
        ldtrefl.LayeredDepthTexture.load(tmp_path / "none.npz")
