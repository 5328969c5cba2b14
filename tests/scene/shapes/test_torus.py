"""The torus: its volume and Euler number."""

import numpy as np
import pytest

from ldtrefl.scene import shapes
from tests.scene.shapes.test_base import assert_estimate_holds, welded


def test_volume_and_euler_number() -> None:
    assert welded("torus").euler_number == 0
    for minor in (0.1, 0.35):
        assert welded("torus", {"minor": minor}).volume == pytest.approx(2 * np.pi**2 * minor**2, rel=0.005)


def test_segments_set_the_count() -> None:
    assert len(shapes.make("torus", {"segments": [10, 6]}).faces) == 2 * 10 * 6


def test_an_arc_is_a_part_of_it() -> None:
    """From +x on, as long as its share of the circle (Pappus), without caps."""
    params: dict[str, object] = {"minor": 0.1, "arc": 90.0, "segments": [192, 96]}
    handle = welded("torus", params)
    assert not handle.is_watertight and handle.euler_number == 0
    assert handle.area == pytest.approx(0.25 * 4 * np.pi**2 * 0.1, rel=1e-3)
    np.testing.assert_allclose(handle.bounds, [[0.0, 0.0, -0.1], [1.1, 1.1, 0.1]], atol=1e-12)
    assert_estimate_holds("torus", params)
