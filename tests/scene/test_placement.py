"""Where an object stands."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.placement import placement

BOUNDS = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 7.0]])
STILL = (0.0, 0.0, 1.0, 0.0)


def placed(point: list[float], matrix: np.ndarray) -> list[float]:
    return (matrix @ [*point, 1.0])[:3].tolist()


def test_fit_centres_the_box_and_scales_its_longest_side() -> None:
    matrix = placement(BOUNDS, 2.0, 1.0, STILL, (0.0, 0.0, 0.0))
    assert placed([1.5, 3.0, 5.0], matrix) == [0.0, 0.0, 0.0] and placed([2.0, 4.0, 7.0], matrix) == [0.25, 0.5, 1.0]


def test_scale_comes_first_then_rotation_then_translation() -> None:
    matrix = placement(BOUNDS, None, (1.0, 2.0, 3.0), (0.0, 0.0, 5.0, 90.0), (10.0, 0.0, 0.0))
    assert placed([1.0, 1.0, 1.0], matrix) == [10.0 - 2.0, 1.0, 3.0]


@pytest.mark.parametrize("degrees", [0.0, 90.0, 180.0, 270.0, 360.0, -90.0, 450.0])
def test_quarter_turns_only_permute_axes(degrees: float) -> None:
    matrix = placement(BOUNDS, None, 1.0, (1.0, 0.0, 0.0, degrees), (0.0, 0.0, 0.0))
    assert set(np.abs(matrix).ravel()) == {0.0, 1.0}


def test_any_turn_keeps_lengths_and_its_axis() -> None:
    axis = np.array([1.0, -2.0, 3.0])
    turn = placement(BOUNDS, None, 1.0, (*axis.tolist(), 33.0), (0.0, 0.0, 0.0))[:3, :3]
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(turn @ axis, axis, atol=1e-15)
    assert np.trace(turn) == pytest.approx(1.0 + 2.0 * np.cos(np.radians(33.0)))


@pytest.mark.parametrize(("fit", "scale"), [(1e-15, 1e-15), (1e15, 10.0), (None, 1e-20), (1e300, 1e300)])
def test_a_size_that_is_not_allowed_is_refused(fit: float | None, scale: float) -> None:
    with pytest.raises(ldtrefl.InputError, match=r"the mesh's own size of 4 give a size of .* along its axes, allowed"):
        placement(BOUNDS, fit, scale, STILL, (0.0, 0.0, 0.0))
