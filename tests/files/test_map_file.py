"""A file of maps that is cut off or changed anywhere is not trusted."""

from pathlib import Path

import numpy as np
import pytest

from ldtrefl.files.map_file import ALIGNMENT, HEADER, parse_map_file, write_map_file

ARRAYS = {
    "x": np.arange(5, dtype=np.int32),
    "y": np.ones((2, 3), np.float32),
    "empty": np.zeros((0, 4), np.float64),
}
VALUES = {"n": 3, "names": ["a", "b"], "share": 0.25, "missing": None}


@pytest.fixture
def content(tmp_path: Path) -> bytearray:
    write_map_file(tmp_path / "maps", ARRAYS, VALUES)
    return bytearray((tmp_path / "maps").read_bytes())


def test_what_was_written_is_read(content: bytearray) -> None:
    entry = parse_map_file(memoryview(bytes(content)))
    assert entry.values == VALUES and list(entry.arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        found = entry.arrays[name]
        assert found.dtype == array.dtype and not found.flags.writeable
        np.testing.assert_array_equal(found, array)
    assert len(content) % ALIGNMENT == 0


def test_a_changed_byte_is_found(content: bytearray) -> None:
    assert len(content) > HEADER.size
    for place in range(len(content)):
        content[place] ^= 0x40
        with pytest.raises(ValueError):
            parse_map_file(memoryview(bytes(content)))
        content[place] ^= 0x40


def test_a_file_that_is_longer_is_not_trusted(content: bytearray) -> None:
    with pytest.raises(ValueError, match="bytes"):
        parse_map_file(memoryview(bytes(content) + b"x"))
