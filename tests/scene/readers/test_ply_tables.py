"""The tables of PLY files: every kind of row, and nothing read beyond the file."""

from pathlib import Path

import numpy as np
import pytest

from ldtrefl import InputError
from ldtrefl.scene.readers.ply_tables import read_header, read_tables
from tests.mesh_writers import write_ply

TABLES = {
    "first": (["list uchar int a", "double b"], [[[1, 2], 0.5], [[], -1.5], [[3], 2.5]]),
    "second": (["uchar c", "list ushort float d", "short e"], [[1, [0.5, 0.25], -7], [2, [1.5, 2.5], 8]]),
    "third": (["int f"], []),
}


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_rows_of_every_kind(tmp_path: Path, kind: str) -> None:
    """Lists of one length and of several, before and behind numbers."""
    data = write_ply(tmp_path / "a.ply", kind, TABLES).read_bytes()
    header = read_header(data)
    tables = read_tables(data, header)
    first, second = tables["first"], tables["second"]
    assert first.lists["a"][0].tolist() == [2, 0, 1] and first.lists["a"][1].tolist() == [1, 2, 3]
    assert first.columns["b"].tolist() == [0.5, -1.5, 2.5] and first.kind("b") == "f8"
    assert second.lists["d"][1].tolist() == [0.5, 0.25, 1.5, 2.5] and second.lists["d"][0].tolist() == [2, 2]
    assert second.columns["c"].tolist() == [1, 2] and second.columns["e"].tolist() == [-7, 8]
    assert len(tables["third"].columns["f"]) == 0
    if header.order:
        for end in range(header.end, len(data)):
            with pytest.raises(InputError, match="the file ends among its"):
                read_tables(data[:end], header)


def test_headers_with_other_ends_of_lines(tmp_path: Path) -> None:
    """Behind a carriage return alone the first byte of a table may be a line feed."""
    plain = write_ply(tmp_path / "a.ply", "binary_little_endian", {"t": (["uchar a"], [[10], [13]])}).read_bytes()
    head, body = plain[:-2], plain[-2:]
    for end in (b"\n", b"\r\n", b"\r"):
        data = head.replace(b"\n", end) + body
        assert read_tables(data, read_header(data))["t"].columns["a"].tolist() == [10, 13]


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("format ascii 2.0\nformat text 1.0", "line 3 of the header is wrong: 'format text 1.0'"),
        ("format ascii 1.0\nelement a -1", "line 3 of the header"),
        ("format ascii 1.0\nproperty int a", "line 3 of the header"),
        ("format ascii 1.0\nelement a 1\nproperty word b", "line 4 of the header"),
        ("format ascii 1.0\nelement a 1\nproperty int b\nproperty int b", "describes 'a' wrongly"),
    ],
)
def test_a_wrong_header_is_a_line(line: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        read_header(f"ply\n{line}\nend_header\n".encode())


def test_text_that_is_no_row_is_a_line() -> None:
    head = b"ply\nformat ascii 1.0\nelement a 2\nproperty list uchar int b\nproperty int c\nend_header\n"
    header = read_header(head)
    for body, says in (
        (b"2 1 2 5\n2 1 2\n", "row 1 of 'a' has too few numbers"),
        (b"2 1 2 5\n9 1 2\n", "row 1 of 'a' has a list of wrong length"),
        (b"2 1 2 5\n1 x 5\n", "line 8: should have numbers, got '1 x 5'"),
        (b"2 1 2 5\n", "the file ends among its 2 rows of 'a'"),
    ):
        with pytest.raises(InputError, match=says):
            read_tables(head + body, header)
    lists = read_tables(head + b"\n2 1 2 5\r\n\n0\t7", header)["a"].lists["b"]
    np.testing.assert_array_equal(lists[0], [2, 0])
