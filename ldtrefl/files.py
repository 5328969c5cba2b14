"""Files that are written whole or not at all, and folders that can be written."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ldtrefl.errors import InputError


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """A file beside ``path``, with its ending, that takes its place at the end of this block, or is gone.

    Raises:
        InputError: it cannot be written.
    """
    path = Path(path)
    scratch = None
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
        os.close(handle)
        scratch = Path(name)
        yield scratch
        scratch.chmod(0o666 & ~_umask())
        os.replace(scratch, path)
    except BaseException as error:
        if scratch is not None:
            scratch.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise InputError(f"{path}: cannot be written ({error.strerror})") from error
        raise


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


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
