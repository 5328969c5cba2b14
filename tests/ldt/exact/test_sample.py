"""A sample of triangles tells how dense a mesh is and how it turns."""

import numpy as np
import pytest
import trimesh

import ldtrefl
from ldtrefl.ldt.exact.sample import Sample


def test_a_sample_tells_density_and_turns() -> None:
    """A sphere of radius 1: a patch of side s turns by s about each axis, and triangles share the area alike."""
    ball = trimesh.creation.icosphere(subdivisions=7)
    side = 0.01
    sample = Sample(ldtrefl.Mesh(ball.vertices, ball.faces), side)
    assert sample.density == pytest.approx(len(ball.faces) * (2 * side) ** 2 / (4 * np.pi), rel=0.1)
    assert sample.turn() == pytest.approx(2 * (2 * side) ** 2, rel=0.3)
    # The same triangles in any order: density is known, turns are not.
    order = np.random.default_rng(0).permutation(len(ball.faces))
    mixed = Sample(ldtrefl.Mesh(ball.vertices, ball.faces[order]), side)
    assert mixed.density == pytest.approx(sample.density, rel=0.1) and mixed.turn() == 0.0
