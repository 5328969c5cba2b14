"""Maps kept on disk between runs: one file for each mesh and set of options, named by a hash of both.

A file is written beside its place and moved there, so that it is whole or absent however many processes write. It
begins with its length and a hash of all that follows; one that does not fit is made anew, with a line of warning. It is
mapped into memory, not copied. When the folder grows beyond its limit, the files not used for longest are removed.

What hashes right is not trusted for that: whoever reads a file checks all of it that indexes memory. The folder and its
files are the user's alone, whether it is the usual folder or one that was asked for: one that belongs to somebody else,
or that others may write into, is refused, and such a file is ignored with a warning. A folder that is missing is made
so, and the usual one is made so if it was not.

A *library* keeps nothing on disk unless :func:`keep_maps_in` is called; the command line does so.
"""

from __future__ import annotations

import contextlib
import json
import logging
import mmap
import os
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
import xxhash

from ldtrefl.base.errors import InputError
from ldtrefl.files.content_key import content_key
from ldtrefl.files.whole import changed_by_others, open_plain, private_folder, written_whole

FORMAT = 2
"""Goes up when what files hold changes: old ones are then not found."""

LIMIT = 1 << 30
"""Bytes that a folder may hold."""

SUFFIX = ".ldtmaps"
ALIGNMENT = 64
HEADER = struct.Struct("<8sQQQ")
"""Magic, length of the file, length of the JSON, hash of all that follows."""
MAGIC = b"ldtmaps\n"

_log = logging.getLogger("ldtrefl")


@dataclass(frozen=True)
class Entry:
    """What a file holds."""

    arrays: dict[str, np.ndarray]
    """Read-only, mapped from the file."""
    values: dict[str, Any]
    """What JSON can hold."""


def key_of(made_from: str, options: dict[str, Any]) -> str:
    """A name for what is made with these options from what has the key ``made_from``: 32 hexadecimal digits."""
    return content_key(json.dumps([FORMAT, made_from, options], sort_keys=True))


class MapCache:
    """A folder of maps."""

    def __init__(self, folder: str | Path | None = None, limit: int = LIMIT) -> None:
        """Use a folder; the user's cache folder if none is given.

        Raises:
            InputError: it cannot be made or written, it is another user's, or others may write into it.
        """
        self.folder = private_folder(_usual_folder() if folder is None else Path(folder))
        self.limit = limit

    def path(self, key: str) -> Path:
        """Where the file of this name is, or would be."""
        return self.folder / f"{key}{SUFFIX}"

    def load(self, key: str, read: Callable[[Entry], Any] = lambda entry: entry) -> Any:
        """What is kept under this name, as ``read`` makes it; None if there is nothing, or nothing that can be trusted.

        ``read`` raises an exception where a file's contents are not sound.
        """
        path = self.path(key)
        try:
            return read(_parsed(self._mapped(path)))
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
            fault = changed_by_others(status)
            if fault:
                raise ValueError(fault)
            if status.st_size > self.limit:
                raise ValueError(f"{status.st_size} bytes, at most {self.limit} are kept")
            whole = memoryview(mmap.mmap(descriptor, 0, access=mmap.ACCESS_READ))
            with contextlib.suppress(OSError):
                os.utime(path)  # used just now
        finally:
            os.close(descriptor)
        return whole

    def store(self, key: str, arrays: dict[str, np.ndarray], values: dict[str, Any]) -> None:
        """Keep arrays and values under this name. A full disk is no fault: then nothing is kept."""
        if self.path(key).is_dir():
            return  # :meth:`load` has said so
        places, offset = {}, 0
        for name, array in arrays.items():
            places[name] = (array.dtype.str, array.shape, offset)
            offset += -(-array.nbytes // ALIGNMENT) * ALIGNMENT
        text = json.dumps({"arrays": places, "values": values}).encode()
        text += b" " * (-(HEADER.size + len(text)) % ALIGNMENT)
        digest = xxhash.xxh3_64(text)
        try:
            with written_whole(self.path(key), private=True) as scratch, scratch.open("wb") as file:
                file.write(HEADER.pack(MAGIC, 0, 0, 0))
                file.write(text)
                for array in arrays.values():
                    data = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
                    for piece in (data.data, bytes(-data.nbytes % ALIGNMENT)):
                        digest.update(piece)
                        file.write(piece)
                file.seek(0)
                file.write(HEADER.pack(MAGIC, HEADER.size + len(text) + offset, len(text), digest.intdigest()))
        except InputError as error:
            _log.warning("%s; the maps are not kept", error)
            return
        self.shrink()

    def files(self) -> list[tuple[Path, int, float]]:
        """(path, bytes, time of the last use) of every file, the one not used for longest first."""
        found = []
        for path in self.folder.glob(f"*{SUFFIX}"):
            try:
                stat = path.lstat()
            except FileNotFoundError:  # another process has removed it
                continue
            found.append((path, stat.st_size, stat.st_mtime))
        return sorted(found, key=lambda entry: entry[2])

    def shrink(self) -> None:
        """Remove what was not used for longest until the limit is kept."""
        files = self.files()
        total = sum(size for _, size, _ in files)
        for path, size, _ in files:
            if total <= self.limit:
                break
            _removed(path)
            total -= size

    def clear(self) -> int:
        """Remove all files; how many there were."""
        return sum(_removed(path) for path, _, _ in self.files())


def _usual_folder() -> Path:
    """The user's cache folder. One of an earlier version, which others could enter, is closed to them."""
    folder = Path(platformdirs.user_cache_dir("ldtrefl", False))
    with contextlib.suppress(OSError):
        folder.chmod(0o700)  # fails where it is missing or somebody else's
    return folder


def _removed(path: Path) -> bool:
    """Remove a file; whether it is gone now."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        _log.warning("%s: cannot be removed (%s)", path, error.strerror)
        return False
    return True


def _parsed(whole: memoryview) -> Entry:
    """The contents of a file; an exception of any kind if they are not what was written."""
    magic, length, text_length, digest = HEADER.unpack(whole[: HEADER.size])
    if magic != MAGIC:
        raise ValueError("not a file of maps")
    if length != len(whole):
        raise ValueError(f"{len(whole)} of {length} bytes")
    if xxhash.xxh3_64_intdigest(whole[HEADER.size :]) != digest:
        raise ValueError("its hash is another")
    held = json.loads(bytes(whole[HEADER.size : HEADER.size + text_length]))
    body = whole[HEADER.size + text_length :]
    arrays = {}
    for name, (dtype, shape, offset) in held["arrays"].items():
        count = int(np.prod(shape))
        arrays[name] = np.frombuffer(body, np.dtype(dtype), count, offset).reshape(shape)
    return Entry(arrays, held["values"])


class _Current:
    """The cache in use; None for none."""

    cache: MapCache | None = None


def keep_maps_in(cache: MapCache | None) -> None:
    """Keep the maps made from now on, and look for them there first; ``None`` to stop."""
    _Current.cache = cache


def current_cache() -> MapCache | None:
    """The cache in use."""
    return _Current.cache
