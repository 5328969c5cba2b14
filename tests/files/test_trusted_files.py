"""Whose files and folders are: plain files are opened, private folders are made, what others may change is told."""

import os
import stat
from pathlib import Path

import pytest

from ldtrefl import InputError
from ldtrefl.files.trusted_files import fault_of_owner, open_plain, private_folder


def test_a_plain_file_is_opened_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"abc")
    (tmp_path / "link").symlink_to("file")
    os.mkfifo(tmp_path / "pipe")
    for name in ("file", "link"):
        with os.fdopen(open_plain(tmp_path / name), "rb") as file:
            assert file.read() == b"abc"
    with pytest.raises(OSError):
        open_plain(tmp_path / "link", follow=False)
    for name in ("pipe", "."):
        with pytest.raises(ValueError, match="not a plain file"):
            open_plain(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        open_plain(tmp_path / "none")


def test_a_missing_folder_is_made_private(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        folder = private_folder(tmp_path / "new" / "private")
    finally:
        os.umask(before)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700 and private_folder(folder) == folder


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o1777])
def test_a_folder_that_others_may_write_into_is_refused(tmp_path: Path, mode: int) -> None:
    tmp_path.chmod(mode)
    with pytest.raises(InputError, match="can be written by others"):
        private_folder(tmp_path)
    tmp_path.chmod(0o755)
    assert private_folder(tmp_path) == tmp_path


def test_a_file_in_the_folders_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="the folder cannot be written"):
            private_folder(folder)


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no users here")
def test_a_file_of_another_user_is_told(tmp_path: Path) -> None:
    own = tmp_path.stat()
    assert fault_of_owner(own) == ""
    others = list(own)
    others[stat.ST_UID] = os.geteuid() + 1
    assert fault_of_owner(os.stat_result(others)) == "belongs to another user"
