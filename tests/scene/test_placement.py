"""Where an object stands."""

import typing

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.placement import UpAxis, placement, placements, wrong_sizes

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


@pytest.mark.parametrize(
    ("up_axis", "axis"),
    [
        ("x", (1, 0, 0)),
        ("y", (0, 1, 0)),
        ("z", (0, 0, 1)),
        ("-x", (-1, 0, 0)),
        ("-y", (0, -1, 0)),
        ("-z", (0, 0, -1)),
    ],
)
def test_the_axis_that_points_up_comes_to_z_by_a_rotation(up_axis: UpAxis, axis: tuple[int, int, int]) -> None:
    turn = placement(BOUNDS, None, 1.0, STILL, (0.0, 0.0, 0.0), up_axis)[:3, :3]
    assert (turn @ axis).tolist() == [0.0, 0.0, 1.0] and np.linalg.det(turn) == 1.0
    np.testing.assert_array_equal(turn @ turn.T, np.eye(3))


def test_with_y_up_the_front_of_gltf_comes_to_minus_y() -> None:
    """glTF 2.0, 3.4: +y is up and the front of an asset faces +z."""
    turn = placement(BOUNDS, None, 1.0, STILL, (0.0, 0.0, 0.0), "y")[:3, :3]
    assert (turn @ [0, 0, 1]).tolist() == [0.0, -1.0, 0.0] and (turn @ [1, 0, 0]).tolist() == [1.0, 0.0, 0.0]


def test_upright_comes_before_the_scale_and_with_the_fit() -> None:
    """Of the box from (1, 2, 3) to (2, 4, 7) the longest side is along z: with y up it lies along y, and the box's
    middle at 0. What was y is stretched as z."""
    matrix = placement(BOUNDS, 2.0, (1.0, 1.0, 3.0), STILL, (0.0, 0.0, 5.0), "y")
    assert placed([1.5, 3.0, 5.0], matrix) == [0.0, 0.0, 5.0]
    assert placed([2.0, 4.0, 7.0], matrix) == [0.25, -1.0, 5.0 + 3.0 * 0.5]


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


def test_many_are_placed_as_each_alone_and_wrong_ones_are_found() -> None:
    rng = np.random.default_rng(0)
    count, low = 50, rng.normal(size=(50, 3))
    bounds = np.stack([low, low + rng.uniform(0.1, 1.0, (count, 3))], axis=1)
    fit = np.where(rng.random(count) < 0.5, np.nan, rng.uniform(0.5, 2.0, count))
    scale, translate = rng.uniform(0.5, 2.0, (count, 3)), rng.normal(size=(count, 3))
    rotate = np.concatenate([rng.normal(size=(count, 3)), rng.choice([0.0, 90.0, 33.0, -400.0], (count, 1))], axis=1)
    up_axes = [typing.get_args(UpAxis)[k % 6] for k in range(count)]
    matrices = placements(bounds, fit, scale, rotate, translate, up_axes)
    for k in range(count):
        given = None if np.isnan(fit[k]) else float(fit[k])
        values = [tuple(row[k].tolist()) for row in (scale, rotate, translate)]
        np.testing.assert_array_equal(matrices[k], placement(bounds[k], given, *values, up_axes[k]))
    assert len(wrong_sizes(matrices, bounds)) == 0
    scale[7, 1], scale[30] = 1e-20, 1e20
    assert wrong_sizes(placements(bounds, fit, scale, rotate, translate, up_axes), bounds).tolist() == [7, 30]
