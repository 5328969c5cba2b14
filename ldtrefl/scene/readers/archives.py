"""The mesh files in a file: itself, or those in an archive, unpacked in memory that was asked for first."""

from __future__ import annotations

import bz2
import gzip
import io
import tarfile
import zipfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import BinaryIO, cast

from trimesh import resolvers
from trimesh.exchange.load import mesh_formats

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError

ARCHIVES = (".zip", ".tar.gz", ".tar.bz2", ".bz2")
"""How the names of archives end."""

MOST_MEMBERS = 10_000
"""Files in an archive: a directory entry is small in the archive and large in memory."""

CHUNK = 1 << 24
"""Bytes that are unpacked at a time."""


class _FilesBeside(resolvers.FilePathResolver):
    """Reads files of a mesh file's folder, plain ones alone, once the memory for them has been asked for."""

    def get(self, name: str) -> bytes:
        """The bytes of a file.

        Raises:
            InputError: it is a pipe, a device or a folder, or too large.
            FileNotFoundError, ValueError: there is none, or it is not in the folder.
        """
        for candidate in (name.strip(), name.strip().lstrip("/"), Path(name).name):
            try:
                path = self.absolute(candidate)
            except ValueError:
                continue
            if path.exists():
                if not path.is_file():
                    raise InputError(f"'{candidate}' beside it is not a file")
                budget.take(path.stat().st_size, f"'{candidate}' beside it")
                return path.read_bytes()
        self.absolute(name)
        raise FileNotFoundError(name)


def archive_kind(path: str | Path) -> str | None:
    """How the file's name ends, if it is an archive's."""
    return next((ending for ending in ARCHIVES if str(path).lower().endswith(ending)), None)


def mesh_files(path: str) -> Iterator[tuple[bytes, str, resolvers.Resolver]]:
    """Every mesh file in a file: (its bytes, its kind such as 'obj', trimesh's resolver for the files beside it).

    Raises:
        InputError: an archive without mesh files or with too many files, or unpacked more than is allowed.
    """
    kind = archive_kind(path)
    if kind is None:
        budget.take(Path(path).stat().st_size, "the file")
        yield Path(path).read_bytes(), _kind(path), _FilesBeside(path)
        return
    members = {".zip": _zip_members, ".bz2": _bz2_members}.get(kind, _tar_members)(path)
    beside = resolvers.ZipResolver({name: io.BytesIO(data) for name, data in members.items()})
    found = [name for name in members if _kind(name) in mesh_formats() and not _is_hidden(name)]
    if not found:
        raise InputError(f"no mesh file in the archive (read are {', '.join(sorted(mesh_formats()))})")
    for name in found:
        yield members[name], _kind(name), beside


def _kind(name: str) -> str:
    return PurePosixPath(name).suffix.lower().lstrip(".")


def _is_hidden(name: str) -> bool:
    """Whether a file of an archive is one of those that macOS adds."""
    return any(part == "__MACOSX" or part.startswith("._") for part in PurePosixPath(name).parts)


def _zip_members(path: str) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        entries = [entry for entry in archive.infolist() if not entry.is_dir()]
        _check_number(len(entries))
        # No more is read than an entry declares.
        budget.take(sum(entry.file_size for entry in entries), "what the archive holds")
        return {entry.filename: archive.read(entry) for entry in entries}


def _tar_members(path: str) -> dict[str, bytes]:
    # Unpacked as a whole first: the reader of tar files takes the lengths of names and headers from the file.
    opener = gzip.open if path.lower().endswith("gz") else bz2.open
    with opener(path) as stream, tarfile.open(fileobj=_unpacked(cast(BinaryIO, stream)), mode="r:") as archive:
        members = {}
        for number, entry in enumerate(archive):
            _check_number(number)
            if entry.isfile():
                budget.take(entry.size, "what the archive holds")
                file = archive.extractfile(entry)
                members[entry.name] = b"" if file is None else file.read()
        return members


def _bz2_members(path: str) -> dict[str, bytes]:
    with bz2.open(path) as stream:
        return {Path(path).stem: _unpacked(cast(BinaryIO, stream)).getvalue()}


def _unpacked(stream: BinaryIO) -> io.BytesIO:
    """All bytes of a stream, whose memory is asked for as they come."""
    result = io.BytesIO()
    while chunk := stream.read(CHUNK):
        budget.take(len(chunk), "what the archive holds")
        result.write(chunk)
    result.seek(0)
    return result


def _check_number(number: int) -> None:
    if number > MOST_MEMBERS:
        raise InputError(f"the archive holds more than {MOST_MEMBERS} files")
