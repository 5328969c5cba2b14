"""The hollow box: its hole goes through it."""

import pytest

from tests.scene.shapes.test_base import assert_estimate_holds, welded


def test_volume_and_euler_number() -> None:
    assert welded("hollow_box").euler_number == 0
    for hole in (0.2, 0.6):
        assert welded("hollow_box", {"hole": hole}).volume == pytest.approx(8.0 - 2 * (2 * hole) ** 2)


def test_it_stays_closed_when_cut_into_segments() -> None:
    assert welded("hollow_box", {"segments": 7}).is_watertight
    assert_estimate_holds("hollow_box", {"segments": 30})
