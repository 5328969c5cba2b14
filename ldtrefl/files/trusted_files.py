"""What is trusted: folders and files that nobody but the user can have changed, and files that are plain ones."""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path

from ldtrefl.base.errors import InputError
from ldtrefl.files.atomic_write import writable_folder


def private_folder(folder: Path) -> Path:
    """``folder``, if only this user may write there; where it is missing it is made, with access for nobody else.

    Raises:
        InputError: it cannot be made or written, it is another user's, or others may write into it.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        fault = fault_of_owner(folder.stat())
    except OSError as error:
        raise InputError(f"{folder}: the folder cannot be written ({error.strerror})") from error
    if fault:
        raise InputError(f"{folder}: {fault}; a folder for maps is its user's alone (mode 0700)")
    return writable_folder(folder)


def fault_of_owner(status: os.stat_result) -> str:
    """Why somebody else could have changed the file or folder of this status; "" if nobody could.

    On systems without users nobody could.
    """
    if hasattr(os, "geteuid"):
        if status.st_uid != os.geteuid():
            return "belongs to another user"
        if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return "can be written by others"
    return ""


def open_plain(path: str | Path, *, follow: bool = True) -> int:
    """A file descriptor for reading a plain file. A pipe is not waited for.

    Args:
        path: the file.
        follow: follow a link; otherwise a link is refused.

    Raises:
        OSError: it cannot be opened.
        ValueError: it is not a plain file, or ``path`` is no name.
    """
    flags = [] if follow else ["O_NOFOLLOW"]
    descriptor = os.open(path, sum(getattr(os, flag, 0) for flag in ["O_RDONLY", "O_NONBLOCK", "O_BINARY", *flags]))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise ValueError("not a plain file")
    return descriptor
