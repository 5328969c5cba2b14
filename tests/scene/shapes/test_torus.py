"""The torus: its volume and Euler number."""

import numpy as np
import pytest

from ldtrefl.scene import shapes
from tests.scene.shapes.test_base import welded


def test_volume_and_euler_number() -> None:
    assert welded("torus").euler_number == 0
    for minor in (0.1, 0.35):
        assert welded("torus", {"minor": minor}).volume == pytest.approx(2 * np.pi**2 * minor**2, rel=0.005)


def test_segments_set_the_count() -> None:
    assert len(shapes.make("torus", {"segments": [10, 6]}).faces) == 2 * 10 * 6
