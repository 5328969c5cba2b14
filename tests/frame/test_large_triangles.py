"""Triangles that cover many pixels are drawn in strips, or at once where too many are set aside: the same pixels."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.frame import large_triangles, zbuffer
from ldtrefl.frame.gbuffer import GBuffer
from ldtrefl.scene.description import Camera, Object
from tests.frame.drawing import assert_same, gbuffer

SHEETS = [
    Object(shape="plane", rotate=(1, k, 0, 70), translate=(0.5 * k - 0.5, 0.4 * k, 0.1), scale=0.8) for k in range(4)
]


@pytest.mark.parametrize("eye", [(0, -3, 0.5), (0.1, 0.05, -0.1)], ids=["before them", "among them"])
def test_strips_and_whole_triangles_are_the_same(
    eye: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []

    def none_set_aside(device: wp.Device) -> large_triangles.LargeTriangles:
        made.append(large_triangles.none_set_aside(device))
        return made[-1]

    def seen(room: int) -> GBuffer:
        monkeypatch.setattr(large_triangles, "ROOM", room)
        return gbuffer(Camera(eye=eye, look_at=(0.2, 5, 0), fov_y=60, width=256, height=256), *SHEETS)

    monkeypatch.setattr(zbuffer, "none_set_aside", none_set_aside)
    strips, some, none = seen(1 << 16), seen(3), seen(0)
    assert [large.found.shape[0] for large in made] == [1 << 16, 3, 0]
    assert all(large.count.numpy()[0] > 3 for large in made), "too few triangles are large"
    assert len(np.unique(strips.objects)) >= 2
    for found in (some, none):
        assert_same(found, strips)
