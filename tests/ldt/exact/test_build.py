"""Building a tree: what it is built over, and the same bits for any number of threads."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene import shapes

from .differences import DENSE_KNOT, differences


@pytest.mark.parametrize(
    ("quality", "wrong_hits", "wrong_misses", "p99"), [("balanced", 0.1, 0.05, 0.1), ("fast", 0.6, 0.2, 0.5)]
)
def test_dense_meshes_become_patches(quality: str, wrong_hits: float, wrong_misses: float, p99: float) -> None:
    mesh = shapes.make("torus_knot", DENSE_KNOT)
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, quality=quality)
    assert maps.tree.patches and maps.nbytes < 4_000_000
    found = differences(mesh, maps, 60_000, 6)
    assert found["wrong_hits"] <= wrong_hits, found
    assert found["wrong_misses"] <= wrong_misses, found
    assert found["p99"] <= p99, found


def test_same_bits_for_any_number_of_threads() -> None:
    for params in ({}, DENSE_KNOT):
        mesh = shapes.make("torus_knot", params)
        rows = []
        for threads in (1, 2, 5):
            ldtrefl.set_threads(threads)
            view = ldtrefl.peel(mesh.vertices, mesh.faces).tree.view
            rows.append([getattr(view, name).numpy().copy() for name in ("nodes", "rows")])
        for other in rows[1:]:
            for a, b in zip(rows[0], other, strict=True):
                np.testing.assert_array_equal(a, b)
