"""How an environment stands in the world."""

import numpy as np
import pytest

from ldtrefl.world.environment_frame import world_from_environment


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0.6, -0.8)], ids=str)
@pytest.mark.parametrize("rotation", [0.0, 35.0, -400.0])
def test_it_is_a_rotation_that_has_up_for_z(up: tuple, rotation: float) -> None:
    made = world_from_environment(np.array(up, float), rotation)
    np.testing.assert_allclose(made.T @ made, np.eye(3), atol=1e-12)
    assert np.linalg.det(made) == pytest.approx(1.0)
    np.testing.assert_allclose(made[:, 2], up, atol=1e-12)


def test_its_x_is_the_worlds_made_level() -> None:
    np.testing.assert_allclose(world_from_environment(np.array([0.0, 0, 1]), 0.0), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(world_from_environment(np.array([1.0, 0, 0]), 0.0)[:, 0], [0, 1, 0], atol=1e-12)
    tilted = world_from_environment(np.array([0.6, 0, 0.8]), 0.0)
    np.testing.assert_allclose(tilted[:, 0], [0.8, 0, -0.6], atol=1e-12)


def test_it_is_turned_counter_clockwise_seen_from_above() -> None:
    np.testing.assert_allclose(world_from_environment(np.array([0.0, 0, 1]), 90.0)[:, 0], [0, 1, 0], atol=1e-12)
