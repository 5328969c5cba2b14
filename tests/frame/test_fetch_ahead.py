"""What is asked of memory ahead changes nothing: the G-buffer of runs of pixels of any length."""

import pytest

from ldtrefl.frame import visibility
from ldtrefl.frame.visibility import draw_gbuffer
from tests.frame.flat_mirror import on_device
from tests.frame.test_zbuffer import assert_same, many


@pytest.mark.parametrize("run", [2, 7, 1000])
@pytest.mark.parametrize("kept", [0, 1 << 22])
def test_runs_of_any_length_give_the_bits_of_single_pixels(
    run: int, kept: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = many(40)
    monkeypatch.setattr("ldtrefl.frame.zbuffer.CORNERS_KEPT", kept)
    monkeypatch.setattr(visibility, "PIXELS_IN_A_ROW", 1)
    expected = draw_gbuffer(on_device(scene), scene.camera)
    monkeypatch.setattr(visibility, "PIXELS_IN_A_ROW", run)
    monkeypatch.setattr(visibility, "UNCACHED", 0)
    assert_same(draw_gbuffer(on_device(scene), scene.camera), expected)
