"""The disc with three holes: its Euler number."""

from tests.scene.shapes.test_base import assert_estimate_holds, welded


def test_it_has_three_holes() -> None:
    for grid in (32, 96):
        assert welded("genus3", {"grid": grid}).euler_number == 2 - 2 * 3
    assert_estimate_holds("genus3", {"grid": 60})
