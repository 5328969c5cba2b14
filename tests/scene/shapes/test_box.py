"""The box: closed however finely it is cut."""

import pytest

from ldtrefl.scene import shapes
from tests.scene.shapes.test_base import welded


def test_volume_and_euler_number() -> None:
    assert welded("box").euler_number == 2 and welded("box").volume == pytest.approx(8.0)


def test_it_stays_closed_when_cut_into_segments() -> None:
    assert welded("box", {"segments": 7}).is_watertight
    assert len(shapes.make("box", {"segments": 4}).faces) == 6 * 2 * 16
