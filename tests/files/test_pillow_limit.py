"""Pillow's own limit is put aside while any thread is inside a block, and is then as it was."""

import threading

import pytest
from PIL import Image

from ldtrefl.files.pillow_limit import no_pixel_limit


def test_blocks_of_several_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)
    is_inside, may_leave = threading.Event(), threading.Event()

    def other() -> None:
        with no_pixel_limit():
            is_inside.set()
            may_leave.wait(60)

    thread = threading.Thread(target=other)
    with no_pixel_limit():
        thread.start()
        assert is_inside.wait(60) and Image.MAX_IMAGE_PIXELS is None
    assert Image.MAX_IMAGE_PIXELS is None, "the other thread is still inside"
    may_leave.set()
    thread.join()
    assert Image.MAX_IMAGE_PIXELS == 100


def test_an_error_inside_restores_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)
    with pytest.raises(ValueError), no_pixel_limit():
        raise ValueError
    assert Image.MAX_IMAGE_PIXELS == 100
