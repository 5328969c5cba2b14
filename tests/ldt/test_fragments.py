"""The fragments of a mesh: no cracks, every layer, on the planes of their triangles."""

from collections.abc import Callable

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes
from tests.conftest import CLOSED_MESHES

CLOSED_SHAPES = [name for name, shape in shapes.all_shapes().items() if shape.is_closed]


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
        assert facing.any()
        expected = a[:, axis] - offset / np.where(facing, normal[:, axis], 1.0)
        np.testing.assert_allclose(depth[span][facing], expected[facing], atol=2e-3)
        assert ((reference[span] & 1) == (normal[:, axis] > 0)).all()
