"""Regular files of moderate size are read; what is none is refused in one line that says what it is."""

import os
from pathlib import Path

import pytest

from ldtrefl import InputError
from ldtrefl.files.regular_files import check_regular, read_regular


def test_a_regular_file_is_read_up_to_its_limit(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"abc")
    (tmp_path / "link").symlink_to("file")
    assert read_regular(tmp_path / "file", 3, "the file") == read_regular(tmp_path / "link", 3, "the file") == b"abc"
    with pytest.raises(InputError, match="file: the file has 3 bytes, at most 2 allowed"):
        read_regular(tmp_path / "file", 2, "the file")


def test_anything_else_is_refused_in_words(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    kinds = {tmp_path / "pipe": "a pipe", tmp_path: "a folder", Path("/dev/null"): "a device or socket"}
    for path, kind in kinds.items():
        for refuse in (lambda path: check_regular(path, "it"), lambda path: read_regular(path, 9, "it")):
            with pytest.raises(InputError, match=f"{path}: it must be a regular file, this is {kind}"):
                refuse(path)


def test_what_is_not_there_is_no_error_of_its_kind(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        check_regular(tmp_path / "none", "it")
    with pytest.raises(InputError, match="none: it cannot be read"):
        read_regular(tmp_path / "none", 9, "it")


def test_a_file_that_becomes_a_pipe_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr("ldtrefl.files.regular_files.check_regular", lambda *_: None)
    with pytest.raises(InputError, match=r"pipe: it must be a regular file$"):
        read_regular(tmp_path / "pipe", 9, "it")
