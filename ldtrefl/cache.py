"""Maps kept on disk between runs: one file for each mesh and set of options, named by a hash of both.

A file is written beside its place and moved there, so that it is whole or absent however many processes write. It
begins with its length and a hash of all that follows; one that does not fit is made anew, with a line of warning. It is
mapped into memory, not copied. When the folder grows beyond its limit, the files not used for longest are removed.

A *library* keeps nothing on disk unless :func:`keep_maps_in` is called; the command line does so.
"""

from __future__ import annotations

import json
import logging
import mmap
import os
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
import xxhash

from ldtrefl.errors import InputError
from ldtrefl.files import writable_folder, written_whole

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


def key_of(arrays: Iterable[np.ndarray], options: dict[str, Any]) -> str:
    """A name for what is made from these arrays with these options: 32 hexadecimal digits."""
    digest = xxhash.xxh3_128(json.dumps([FORMAT, options], sort_keys=True).encode())
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


class MapCache:
    """A folder of maps."""

    def __init__(self, folder: str | Path | None = None, limit: int = LIMIT) -> None:
        """Use a folder; the user's cache folder if none is given.

        Raises:
            InputError: it cannot be made or written.
        """
        chosen = Path(platformdirs.user_cache_dir("ldtrefl", False)) if folder is None else Path(folder)
        self.folder = writable_folder(chosen, make=True)
        self.limit = limit

    def path(self, key: str) -> Path:
        """Where the file of this name is, or would be."""
        return self.folder / f"{key}{SUFFIX}"

    def load(self, key: str) -> Entry | None:
        """What is kept under this name; None if there is nothing, or nothing that can be trusted."""
        path = self.path(key)
        try:
            with path.open("rb") as file:
                whole = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
            entry = _parsed(whole)
            os.utime(path)  # used just now
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError, struct.error) as error:
            _log.warning("%s: damaged (%s), made anew", path, error)
            return None
        return entry

    def store(self, key: str, arrays: dict[str, np.ndarray], values: dict[str, Any]) -> None:
        """Keep arrays and values under this name. A full disk is no fault: then nothing is kept."""
        places, offset = {}, 0
        for name, array in arrays.items():
            places[name] = (array.dtype.str, array.shape, offset)
            offset += -(-array.nbytes // ALIGNMENT) * ALIGNMENT
        text = json.dumps({"arrays": places, "values": values}).encode()
        text += b" " * (-(HEADER.size + len(text)) % ALIGNMENT)
        digest = xxhash.xxh3_64(text)
        try:
            with written_whole(self.path(key)) as scratch, scratch.open("wb") as file:
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
                stat = path.stat()
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
            path.unlink(missing_ok=True)
            total -= size

    def clear(self) -> int:
        """Remove all files; how many there were."""
        files = self.files()
        for path, _, _ in files:
            path.unlink(missing_ok=True)
        return len(files)


def _parsed(whole: memoryview) -> Entry:
    """The contents of a file.

    Raises:
        ValueError, KeyError, TypeError, struct.error: they are not what was written.
    """
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
