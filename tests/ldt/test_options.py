"""The options of a layered depth texture: NumPy's numbers are taken, and what is not allowed is named."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.ldt import options


def test_plain_and_numpy_values_are_taken() -> None:
    assert options.checked_resolution(np.int32(64)) == 64
    assert options.checked_quality("fast") == "fast"
    assert options.checked_linear_steps("texel") == "texel" and options.checked_linear_steps(np.int64(7)) == 7
    assert options.checked_binary_steps(0) == 0


@pytest.mark.parametrize(
    ("check", "name", "wrong"),
    [
        (options.checked_resolution, "resolution", [15, 4097, 64.0, True, "64", None]),
        (options.checked_quality, "quality", ["best", 1, None]),
        (options.checked_linear_steps, "linear_steps", [0, 100_001, 1.0, True, "texels"]),
        (options.checked_binary_steps, "binary_steps", [-1, 65, 1.5, "8"]),
    ],
)
def test_wrong_values_are_refused_in_one_line(check: object, name: str, wrong: list) -> None:
    for value in wrong:
        with pytest.raises(ldtrefl.InputError, match=f"^{name}: ") as refused:
            check(value)
        assert "\n" not in str(refused.value)
