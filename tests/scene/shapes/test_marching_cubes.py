"""Surfaces by marching cubes, against a ball."""

import numpy as np

from ldtrefl.scene.shapes.marching_cubes import implicit
from ldtrefl.scene.shapes.surfaces import signed_volume


def test_a_ball_is_round_and_faces_outwards() -> None:
    ball = implicit(lambda x, y, z: 1.0 - x**2 - y**2 - z**2, (1.2, 1.2, 1.2), 48)
    np.testing.assert_allclose(np.linalg.norm(ball.vertices, axis=1), 1.0, atol=0.01)
    np.testing.assert_allclose(signed_volume(ball.vertices, ball.faces), 4 / 3 * np.pi, rtol=0.02)
