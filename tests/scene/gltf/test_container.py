"""The container: JSON and GLB, buffers in the file, in data URIs and beside it, and never outside its folder."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import DEEPEST, Document
from tests.scene.gltf.writer import QUAD, Written, nothing_beside


def test_glb_and_json_hold_the_same(tmp_path: Path) -> None:
    file = Written()
    file.quad()
    for name in ("a.glb", "a.gltf"):
        np.testing.assert_array_equal(ldtrefl.load_mesh(file.save(tmp_path, name)).vertices, QUAD)


def test_buffers_beside_the_file_are_read_by_their_percent_encoded_names(tmp_path: Path) -> None:
    file = Written()
    file.quad()
    (tmp_path / "my data.bin").write_bytes(file.blob)
    tree = {**file.tree, "buffers": [{"uri": "my%20data.bin", "byteLength": len(file.blob)}]}
    (tmp_path / "a.gltf").write_bytes(b"\xef\xbb\xbf" + json.dumps(tree).encode())
    np.testing.assert_array_equal(ldtrefl.load_mesh(tmp_path / "a.gltf").vertices, QUAD)


@pytest.mark.parametrize(
    "name", ["../secret.bin", "/{}/secret.bin", "%2e%2e/secret.bin", "file:///{}/secret.bin", "http://a.b/c"]
)
def test_nothing_is_read_outside_the_folder(tmp_path: Path, name: str) -> None:
    file = Written()
    file.quad()
    (tmp_path / "secret.bin").write_bytes(file.blob)
    folder = tmp_path / "inner"
    folder.mkdir()
    uri = name.format(str(tmp_path).strip("/"))
    tree = {**file.tree, "buffers": [{"uri": uri, "byteLength": len(file.blob)}]}
    (folder / "a.gltf").write_text(json.dumps(tree))
    with pytest.raises(InputError, match=r"buffers\[0\]\.uri"):
        ldtrefl.load_mesh(folder / "a.gltf")


def document(tree: object) -> Document:
    """A document of JSON alone."""
    return Document(json.dumps(tree).encode(), nothing_beside)


@pytest.mark.parametrize("version", ["1.0", 2, None])
def test_other_versions_are_refused(version: object) -> None:
    with pytest.raises(InputError, match=r"asset\.version: glTF 2\.0 is read"):
        document({"asset": {"version": version}})


def test_what_needs_a_later_version_is_refused() -> None:
    """``version`` says what a file was written by, ``minVersion`` what is needed to read it (3.2)."""
    document({"asset": {"version": "2.5"}})
    document({"asset": {"version": "2.1", "minVersion": "2.0"}})
    with pytest.raises(InputError, match=r"asset\.minVersion: glTF 2\.0 is read, got 2\.1"):
        document({"asset": {"version": "2.1", "minVersion": "2.1"}})


def test_json_may_be_filled_up_with_zeros() -> None:
    text = b'{"asset": {"version": "2.0"}}'
    body = struct.pack("<I4s", len(text) + 3, b"JSON") + text + bytes(3)
    assert Document(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body, nothing_beside).root["asset"]


def test_what_is_no_json_is_refused_in_one_line() -> None:
    deep = b'{"a": ' + b"[" * (DEEPEST + 1) + b"]" * (DEEPEST + 1) + b"}"
    for data in (b"{", b"[]", b"\xff\xfe\x00", b"[" * 100_000, deep):
        with pytest.raises(InputError, match="JSON"):
            Document(data, nothing_beside)


def test_a_file_that_is_cut_off_says_so() -> None:
    file = Written()
    file.quad()
    data = file.as_glb()
    for length in (4, 11, 19, 30, len(data) - 1):
        with pytest.raises(InputError, match=r"cut off|reaches beyond|version"):
            Document(data[:length], nothing_beside)


def test_chunks_of_other_kinds_are_passed_over() -> None:
    header = b'{"asset": {"version": "2.0"}}   '
    chunk = struct.pack("<I4s", 3, b"ABCD") + b"abc\0"
    body = struct.pack("<I4s", len(header), b"JSON") + header + chunk
    found = Document(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body, nothing_beside)
    assert found.root["asset"]["version"] == "2.0"


def test_a_view_beyond_its_buffer_is_refused() -> None:
    uri = "data:;base64,AAAAAA=="
    found = document(
        {
            "asset": {"version": "2.0"},
            "buffers": [{"uri": uri, "byteLength": 4}, {"uri": uri, "byteLength": 9}, {"byteLength": 1}],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 1, "byteLength": 3},
                {"buffer": 0, "byteOffset": 2, "byteLength": 3},
                {"buffer": 1, "byteLength": 1},
                {"buffer": 2, "byteLength": 1},
            ],
        }
    )
    assert bytes(found.view(0, "here")) == bytes(3)
    for number, match in ((1, "ends at byte 5 of a buffer of 4"), (2, "9 bytes are announced"), (3, "no 'uri'")):
        with pytest.raises(InputError, match=match):
            found.view(number, "here")
    for number in (4, -1, "0", None, True):
        with pytest.raises(InputError, match=r"here: there is no bufferViews"):
            found.view(number, "here")


def test_large_data_in_the_json_are_not_taken_for_many_values(tmp_path: Path) -> None:
    file = Written()
    file.quad()
    file.view(bytes(4_000_000))
    with budget.account() as account:
        ldtrefl.load_mesh(file.save(tmp_path, "a.gltf"))
    assert 5_000_000 < account.taken < 50_000_000


def test_data_uris_may_be_plain_or_damaged() -> None:
    found = document({"asset": {"version": "2.0"}})
    assert found.file("data:text/plain,a%20b", "here") == b"a b"
    for uri in ("data:", "data:;base64,A"):
        with pytest.raises(InputError, match="here: "):
            found.file(uri, "here")
