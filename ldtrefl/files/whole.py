"""Files that are written whole or not at all, folders that can be written, and files that are read with caution."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ldtrefl.base.errors import InputError

LONGEST_STEM = 32
"""Characters of a file's name that its scratch file shows: the whole name may be as long as a name can be."""


@contextmanager
def written_whole(path: str | Path, *, private: bool = False) -> Iterator[Path]:
    """A file beside ``path``, with its ending, that takes its place at the end of this block, or is gone.

    A link is followed: its target is replaced, but in a cache the link itself. A file that is there already keeps its
    permissions, and its owner if that can be. The data are on the disk before the file takes its place.

    Args:
        path: where the file shall be.
        private: a file of a cache, that nobody else may read, and that can be made again: it is not waited for.

    Raises:
        InputError: it cannot be written.
    """
    target = Path(path) if private else replaceable(path)
    scratch = None
    try:
        scratch = _new_file_beside(target, 0o600 if private else 0o666)
        yield scratch
        if not private:
            _sync(scratch, os.O_RDWR)
            _take_permissions(scratch, target)
        os.replace(scratch, target)
    except BaseException as error:
        if scratch is not None:
            scratch.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise InputError(f"{path}: cannot be written ({error.strerror or error})") from error
        raise
    if not private:
        with contextlib.suppress(OSError):  # not every file system can; the file itself is on the disk
            _sync(target.parent, os.O_RDONLY)


def replaceable(path: str | Path) -> Path:
    """The plain file that writing to ``path`` would replace, or make: the target of a link.

    Raises:
        InputError: a folder, a pipe or a device is in its place, or the file may not be written.
    """
    try:
        target = Path(os.path.realpath(path))
        mode = target.stat().st_mode
    except FileNotFoundError:
        return target
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be written ({getattr(error, 'strerror', None) or error})") from error
    if stat.S_ISDIR(mode):
        raise InputError(f"{path}: is a folder, a file name is needed")
    if not stat.S_ISREG(mode):
        raise InputError(f"{path}: is a pipe or a device, which would be replaced: a plain file is needed")
    if not os.access(target, os.W_OK):
        raise InputError(f"{path}: is write-protected")
    return target


def writable_folder(folder: Path, *, make: bool = False) -> Path:
    """``folder``, made if it may be.

    Raises:
        InputError: it cannot be made or written.
    """
    try:
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"{folder}: the folder cannot be written ({error.strerror})") from error
    return folder


def private_folder(folder: Path) -> Path:
    """``folder``, which only this user may write; made, with access for nobody else, where it is missing.

    Raises:
        InputError: it cannot be made or written, it is another user's, or others may write into it.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        fault = changed_by_others(folder.stat())
    except OSError as error:
        raise InputError(f"{folder}: the folder cannot be written ({error.strerror})") from error
    if fault:
        raise InputError(f"{folder}: {fault}; a folder for maps is its user's alone (mode 0700)")
    return writable_folder(folder)


def changed_by_others(status: os.stat_result) -> str:
    """Why somebody else could change what this is the status of; "" if nobody could. Without users nobody can."""
    if hasattr(os, "geteuid"):
        if status.st_uid != os.geteuid():
            return "belongs to another user"
        if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return "can be written by others"
    return ""


def open_plain(path: str | Path, *, follow: bool = True) -> int:
    """A file descriptor for reading a plain file. A pipe is not waited for, and a link is followed if it may be.

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


def _new_file_beside(target: Path, mode: int) -> Path:
    """A new, empty file with ``target``'s ending, of this mode but for what the process' mask takes away."""
    while True:
        name = f".{target.stem[:LONGEST_STEM]}-{secrets.token_hex(4)}{target.suffix}"
        with contextlib.suppress(FileExistsError):
            os.close(os.open(target.parent / name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode))
            return target.parent / name


def _take_permissions(scratch: Path, target: Path) -> None:
    """Give ``scratch`` the permissions of the file that it replaces, if there is one, and its owner if that can be."""
    with contextlib.suppress(FileNotFoundError):
        kept = target.stat()
        own = scratch.stat()
        if (own.st_uid, own.st_gid) != (kept.st_uid, kept.st_gid):
            with contextlib.suppress(OSError):
                os.chown(scratch, kept.st_uid, kept.st_gid)
        scratch.chmod(stat.S_IMODE(kept.st_mode))


def _sync(path: Path, access: int) -> None:
    """Wait until a file, or the names in a folder, are on the disk.

    Raises:
        OSError: they are not.
    """
    descriptor = os.open(path, access)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
