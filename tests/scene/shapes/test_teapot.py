"""The teapot: its patches meet."""

import numpy as np

from tests.scene.shapes.test_base import assert_estimate_holds, welded


def test_patches_meet_along_the_mirror_planes() -> None:
    """An edge with one triangle lies on the rim, the lid's or the bottom's edge, or where handle and spout end."""
    pot = welded("teapot", {"segments": 8})
    edges, counts = np.unique(
        np.sort(pot.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True
    )
    ends = pot.vertices[edges[counts == 1]]
    assert not (ends[..., 1] == 0.0).all(axis=1).any()
    assert_estimate_holds("teapot", {"segments": 40})
