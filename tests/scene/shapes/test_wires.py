"""The wires: as many closed cylinders as are asked for."""

from tests.scene.shapes.test_base import assert_estimate_holds, welded


def test_every_wire_is_closed() -> None:
    assert welded("wires").euler_number == 2 * 16
    one = welded("wires", {"count": 1, "radius": 0.2})
    assert one.is_watertight and one.euler_number == 2 * 2
    assert_estimate_holds("wires", {"count": 3, "segments": 30})
