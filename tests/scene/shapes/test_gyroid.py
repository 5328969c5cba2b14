"""The gyroid: closed and in one piece, whatever its periods."""

import pytest

from tests.scene.shapes.test_base import assert_estimate_holds, welded


@pytest.mark.parametrize("periods", [1.0, 6.0])
def test_it_is_closed(periods: float) -> None:
    assert welded("gyroid", {"periods": periods, "grid": 60}).is_watertight
    assert_estimate_holds("gyroid", {"periods": periods, "grid": 60})
