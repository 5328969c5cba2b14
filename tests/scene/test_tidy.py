"""Numbers that a person would write."""

import numpy as np
import pytest

from ldtrefl.scene.tidy import decimals_for, tidy, tidy_below, tidy_point


@pytest.mark.parametrize(("size", "digits"), [(1.0, 3), (9.99, 3), (1597.2, 0), (95833.0, -1), (0.05, 5), (1e-6, 9)])
def test_a_size_is_written_with_four_figures(size: float, digits: int) -> None:
    assert decimals_for(size) == digits


def test_coordinates_are_rounded_and_zero_has_no_sign() -> None:
    assert tidy_point(np.array([1234.56, -0.04, 0.26]), 1) == (1234.6, 0.0, 0.3)
    assert tidy(1234.56, -2) == 1200.0 and str(tidy(-0.04, 1)) == "0.0"


@pytest.mark.parametrize(
    ("value", "digits", "below"),
    [(1.26, 1, 1.2), (-1.26, 1, -1.3), (0.3, 1, 0.3), (-0.04, 1, -0.1), (129.0, -1, 120.0)],
)
def test_what_is_below_is_never_above(value: float, digits: int, below: float) -> None:
    assert tidy_below(value, digits) == below <= value
