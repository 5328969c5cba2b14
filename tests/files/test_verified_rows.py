"""Rows that are written are read back: what a file does not hold is found."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

import ldtrefl
from ldtrefl.files import verified_rows
from ldtrefl.files.verified_rows import blocks, write_verified

NAMES = ("G", "R", "B", "zebra.X", "apple.X")
"""In an order that is not the file's."""


def spec() -> oiio.ImageSpec:
    made = oiio.ImageSpec(30, 20, len(NAMES), oiio.FLOAT)
    made.channelnames = NAMES
    return made


def pixels() -> np.ndarray:
    return np.random.default_rng(0).random((20, 30, len(NAMES))).astype(np.float32)


def test_channels_are_found_by_their_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verified_rows, "BYTES_AT_ONCE", 3000)  # several blocks
    write_verified(tmp_path / "a.exr", spec(), lambda top, bottom: pixels()[top:bottom])
    reader = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    names, found = reader.spec().channelnames, np.asarray(reader.read_image(oiio.FLOAT))
    reader.close()
    for channel, name in enumerate(NAMES):
        np.testing.assert_array_equal(found[..., names.index(name)], pixels()[..., channel])


def test_a_file_that_holds_something_else_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verified_rows, "_digest_of_file", lambda *_: b"another")
    with pytest.raises(ldtrefl.InputError, match=r"a\.exr: could not be written"):
        write_verified(tmp_path / "a.exr", spec(), lambda top, bottom: pixels()[top:bottom])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("height", [1, 7, 8, 9])
def test_blocks_hold_every_row_once(height: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verified_rows, "BYTES_AT_ONCE", 400)
    parts = list(blocks(height, 100))
    assert [row for top, bottom in parts for row in range(top, bottom)] == list(range(height))
    assert all(bottom - top <= 4 for top, bottom in parts)
    assert list(blocks(2, 1000)) == [(0, 1), (1, 2)], "a row is never cut"
