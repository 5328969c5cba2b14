"""Files that are written whole or not at all, and what can be written: files that may be replaced, folders."""

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
    """A scratch file beside ``path``, with its ending, to be written in this block. Then it takes ``path``'s place.

    If the block raises, the scratch file is removed and ``path`` stays as it was. If ``path`` is a link, its target is
    replaced. A file that is replaced hands on its permissions, and its owner where that is allowed. The data are on the
    disk before the file takes its place.

    Args:
        path: where the file shall be.
        private: the file belongs to a cache. Nobody else may read it; a link in its place is itself replaced; the
            program does not wait until it is on the disk, as it can be made again.

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
    """The plain file that writing to ``path`` would replace or make: if ``path`` is a link, its target.

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
    """``folder``, if files can be written there; with ``make`` it is made where it is missing.

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


def _new_file_beside(target: Path, mode: int) -> Path:
    """A new, empty file with ``target``'s ending; its mode is ``mode`` less the process' umask."""
    while True:
        name = f".{target.stem[:LONGEST_STEM]}-{secrets.token_hex(4)}{target.suffix}"
        with contextlib.suppress(FileExistsError):
            os.close(os.open(target.parent / name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode))
            return target.parent / name


def _take_permissions(scratch: Path, target: Path) -> None:
    """Give ``scratch`` the permissions, and where that is allowed the owner, of the file that it replaces, if any."""
    with contextlib.suppress(FileNotFoundError):
        old, new = target.stat(), scratch.stat()
        if (new.st_uid, new.st_gid) != (old.st_uid, old.st_gid):
            with contextlib.suppress(OSError):
                os.chown(scratch, old.st_uid, old.st_gid)
        scratch.chmod(stat.S_IMODE(old.st_mode))


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
