"""Matrices as places: scale, rotation and translation where these can say it, and else the matrix."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ldtrefl.scene.decomposition import placed
from ldtrefl.scene.placement import placement

BOX = np.array([[-1.0] * 3, [1.0] * 3])
TURNS = [[0, 0, 0], [0, 0, 1e-9], [0.3, -2, 1], [np.pi, 0, 0], [0, np.pi, 0], [0, 0, np.pi - 1e-9], [-1.8, 1.8, 1.8]]


def again(place: dict[str, object]) -> np.ndarray:
    """The matrix that an object placed so has."""
    whole = {"fit": None, "scale": 1.0, "rotate": (0.0, 0.0, 1.0, 0.0), "translate": (0.0, 0.0, 0.0), **place}
    return placement(BOX, **whole)  # type: ignore[arg-type]


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("scale", [1.0, 1e-3, (2.0, 0.5, 3.0)])
def test_rotations_and_scales_come_back(turn: list[float], scale: float | tuple[float, float, float]) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(turn).as_matrix() * np.broadcast_to(scale, 3)
    matrix[:3, 3] = [1, -2, 3]
    place = placed(matrix)
    assert "matrix" not in place and place["translate"] == (1, -2, 3)
    assert isinstance(place["scale"], float) == isinstance(scale, float)
    np.testing.assert_allclose(again(place), matrix, atol=1e-14 * np.max(scale))


@pytest.mark.parametrize("linear", [np.diag([-1.0, 1, 1]), np.array([[1.0, 1, 0], [0, 1, 0], [0, 0, 1]])])
def test_mirrored_and_sheared_places_stay_matrices(linear: np.ndarray) -> None:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, [1, 2, 3]
    place = placed(matrix)
    assert place.keys() == {"matrix"}
    np.testing.assert_array_equal(again(place), matrix)
