"""The torus knot: one closed tube."""

import pytest

from tests.scene.shapes.test_base import welded


@pytest.mark.parametrize(("p", "q"), [(2, 3), (3, 7), (1, 1)])
def test_it_is_one_closed_tube(p: int, q: int) -> None:
    knot = welded("torus_knot", {"p": p, "q": q, "segments": [400, 12]})
    assert knot.is_watertight and knot.euler_number == 0 and knot.body_count == 1
