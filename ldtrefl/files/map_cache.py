"""Maps kept on disk between runs: one file for each mesh and set of options, named by a hash of both.

A file (``map_file.py``) is written beside its place and moved there, so that it is whole or absent however many
processes write. One that is damaged is made anew, with a line of warning. Files are mapped into memory, not copied.
When the folder grows beyond its limit, the files that were not used for longest are removed.

A right hash alone is no reason to trust a file: whoever reads one checks all of it that indexes memory. The folder and
its files are the user's alone, whether it is the usual folder or one that was asked for. A folder that belongs to
somebody else, or that others may write into, is refused; such a file is ignored with a warning. A folder that is
missing is made private, and the usual folder is made private if it was not.

Used as a library, the package keeps nothing on disk unless :func:`keep_maps_in` is called; the command line does so.
"""

from __future__ import annotations

import contextlib
import json
import logging
import mmap
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np
import platformdirs

from ldtrefl.base.errors import InputError
from ldtrefl.files.atomic_write import written_whole
from ldtrefl.files.content_key import content_key
from ldtrefl.files.map_file import Entry, parse_map_file, write_map_file
from ldtrefl.files.trusted_files import fault_of_owner, open_plain, private_folder

FORMAT = 2
"""Goes up when what files hold changes: old ones are then not found."""

LIMIT = 1 << 30
"""Bytes that a folder may hold, unless another limit is given."""

SUFFIX = ".ldtmaps"

Made = TypeVar("Made")

_log = logging.getLogger("ldtrefl")


def key_of(made_from: str, options: Mapping[str, object]) -> str:
    """A name for what is made with these options from what has the key ``made_from``: 32 hexadecimal digits.

    Options are what JSON can hold.
    """
    return content_key(json.dumps([FORMAT, made_from, options], sort_keys=True))


class MapCache:
    """A folder of files of maps."""

    def __init__(self, folder: str | Path | None = None, limit: int = LIMIT) -> None:
        """Use a folder, made if it is missing; the user's cache folder if none is given.

        Args:
            folder: where the files are.
            limit: bytes that the folder may hold.

        Raises:
            InputError: it cannot be made or written, it is another user's, or others may write into it.
        """
        self.folder = private_folder(_usual_folder() if folder is None else Path(folder))
        self.limit = limit

    def path(self, key: str) -> Path:
        """Where the file of this name is, or would be."""
        return self.folder / f"{key}{SUFFIX}"

    def load(self, key: str) -> Entry | None:
        """The entry of this name; None if there is none, or its file is damaged, with a line of warning."""
        return self.load_as(key, lambda entry: entry)

    def load_as(self, key: str, read: Callable[[Entry], Made]) -> Made | None:
        """What ``read`` makes of the entry of this name; None if there is none, or it is not sound, with a warning.

        ``read`` raises an exception, of any kind, where an entry is not sound.
        """
        path = self.path(key)
        try:
            return read(parse_map_file(self._mapped(path)))
        except FileNotFoundError:
            return None
        except Exception as error:  # whatever a damaged file provokes is the file's fault
            words = " ".join(str(error).split()) or type(error).__name__
            _log.warning("%s: not to be trusted (%s), made anew", path, words)
            return None

    def _mapped(self, path: Path) -> memoryview:
        """A file's bytes, mapped into memory.

        Raises:
            OSError, ValueError: it cannot be read, or is not a plain file of this user's alone.
        """
        if path.is_symlink():
            raise ValueError("a link")
        descriptor = open_plain(path, follow=False)
        try:
            status = os.fstat(descriptor)
            fault = fault_of_owner(status)
            if fault:
                raise ValueError(fault)
            if status.st_size > self.limit:
                raise ValueError(f"{status.st_size} bytes, at most {self.limit} are kept")
            content = memoryview(mmap.mmap(descriptor, 0, access=mmap.ACCESS_READ))
            with contextlib.suppress(OSError):
                os.utime(path)  # used just now
        finally:
            os.close(descriptor)
        return content

    def store(self, key: str, arrays: Mapping[str, np.ndarray], values: Mapping[str, object]) -> None:
        """Keep arrays, and values that JSON can hold, under this name.

        A full disk is no error: then nothing is kept, with a line of warning.
        """
        if self.path(key).is_dir():
            return  # :meth:`load` has said so
        try:
            with written_whole(self.path(key), private=True) as scratch:
                write_map_file(scratch, arrays, values)
        except InputError as error:
            _log.warning("%s; the maps are not kept", error)
            return
        self.shrink()

    def files(self) -> list[tuple[Path, int, float]]:
        """(path, bytes, time of the last use in seconds) of every file, the one not used for longest first."""
        found = []
        for path in self.folder.glob(f"*{SUFFIX}"):
            try:
                stat = path.lstat()
            except FileNotFoundError:  # another process has removed it
                continue
            found.append((path, stat.st_size, stat.st_mtime))
        return sorted(found, key=lambda entry: entry[2])

    def shrink(self) -> None:
        """Remove the files that were not used for longest, until the folder holds no more than its limit."""
        files = self.files()
        total = sum(size for _, size, _ in files)
        for path, size, _ in files:
            if total <= self.limit:
                break
            _remove(path)
            total -= size

    def clear(self) -> int:
        """Remove all files: how many were removed."""
        return sum(_remove(path) for path, _, _ in self.files())


def _usual_folder() -> Path:
    """The user's cache folder. If it is there already, made by an earlier version, it is closed to others."""
    folder = Path(platformdirs.user_cache_dir("ldtrefl", False))
    with contextlib.suppress(OSError):
        folder.chmod(0o700)  # fails where it is missing or somebody else's
    return folder


def _remove(path: Path) -> bool:
    """Remove a file: whether it is gone now."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        _log.warning("%s: cannot be removed (%s)", path, error.strerror)
        return False
    return True


class _InUse:
    """The cache that maps are kept in; None if they are not kept."""

    cache: MapCache | None = None


def keep_maps_in(cache: MapCache | None) -> None:
    """Keep the maps made from now on, and look for them there first; ``None`` to stop."""
    _InUse.cache = cache


def current_cache() -> MapCache | None:
    """The cache that maps are kept in; None if they are not kept."""
    return _InUse.cache
