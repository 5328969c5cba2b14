"""Fragments of a sphere and of a cube, which are known on paper."""

import numpy as np

import ldtrefl
from ldtrefl.scene import shapes


def test_sphere_peels_to_two_fragments_at_analytic_depths() -> None:
    mesh = shapes.make("sphere", {"segments": [512, 256]})
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=64)
    assert maps.layers() == {"+x": 1, "-x": 1, "+y": 1, "-y": 1, "+z": 1, "-z": 1}
    start, depth = maps.start.numpy(), maps.depth.numpy()
    for axis in range(3):
        counts = maps.counts(axis)
        v, u = np.meshgrid(np.arange(64) + 0.5, np.arange(64) + 0.5, indexing="ij")
        square = 32.0**2 - (u - 32) ** 2 - (v - 32) ** 2
        inside = square > 32.0  # away from the rim, where the tessellation decides
        assert (counts[inside] == 2).all()
        first = start[maps.frame.first_texels[axis] :][: 64 * 64].reshape(64, 64)[inside]
        half_chord = np.sqrt(square[inside])
        np.testing.assert_allclose(depth[first], 32 - half_chord, atol=0.02)
        np.testing.assert_allclose(depth[first + 1], 32 + half_chord, atol=0.02)


def test_cube_peels_exactly() -> None:
    mesh = shapes.make("box")
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution=32)
    assert maps.fragment_count == 3 * 2 * 32 * 32
    assert all((maps.counts(axis) == 2).all() for axis in range(3))
    assert set(maps.depth.numpy().tolist()) == {0.0, 32.0}
    reference = maps.reference.numpy().reshape(-1, 2)
    assert (reference[:, 0] & 1 == 0).all() and (reference[:, 1] & 1 == 1).all()
