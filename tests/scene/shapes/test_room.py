"""The room: a box turned inside out."""

import pytest

from tests.scene.shapes.test_base import welded


def test_volume_and_euler_number() -> None:
    assert welded("room").euler_number == 2 and welded("room").volume == pytest.approx(-8.0)


def test_it_stays_closed_when_cut_into_segments() -> None:
    assert welded("room", {"segments": 7}).is_watertight
