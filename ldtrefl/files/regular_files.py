"""Regular files that a user names: a folder, a pipe or a device, which may never end, is refused in words."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from ldtrefl.base.errors import InputError
from ldtrefl.files.trusted_files import open_plain


def read_regular(path: Path, limit: int, what: str) -> bytes:
    """The bytes of a regular file of at most ``limit`` bytes.

    Args:
        path: the file.
        limit: the most bytes that it may have.
        what: the file in words, such as "the scene file".

    Raises:
        InputError: naming the file; it cannot be read, is not a regular file, or is too large.
    """
    try:
        check_regular(path, what)
        with open(_opened(path, what), "rb") as file:
            size = os.fstat(file.fileno()).st_size
            data = file.read(limit + 1) if size <= limit else None
    except OSError as error:
        raise InputError(f"{path}: {what} cannot be read ({error.strerror})") from error
    if data is None or len(data) > limit:
        raise InputError(f"{path}: {what} has {size} bytes, at most {limit} allowed")
    return data


def _opened(path: Path, what: str) -> int:
    """A descriptor of a file that was regular just now."""
    try:
        return open_plain(path)
    except ValueError as error:  # it has become something else since
        raise InputError(f"{path}: {what} must be a regular file") from error


def check_regular(path: Path, what: str) -> None:
    """Refuse what is there and is no regular file.

    Raises:
        OSError: there is nothing of this name.
        InputError: a folder, a pipe or a device.
    """
    try:
        mode = path.stat().st_mode
    except ValueError as error:  # a null character
        raise InputError(f"{path}: is no file name") from error
    if not stat.S_ISREG(mode):
        kind = "a folder" if stat.S_ISDIR(mode) else "a pipe" if stat.S_ISFIFO(mode) else "a device or socket"
        raise InputError(f"{path}: {what} must be a regular file, this is {kind}")
