"""The bowl: with a wall, or one sheet."""

from tests.scene.shapes.test_base import assert_estimate_holds, welded


def test_a_wall_closes_it() -> None:
    assert welded("bowl").euler_number == 2
    assert welded("bowl", {"depth": 1.0, "thickness": 0.4, "segments": [12, 4]}).is_watertight


def test_without_a_wall_it_is_one_sheet() -> None:
    sheet = welded("bowl", {"closed": False})
    assert not sheet.is_watertight and sheet.euler_number == 1
    assert_estimate_holds("bowl", {"closed": False})
