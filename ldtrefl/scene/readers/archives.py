"""The mesh files in a file: itself, or those in an archive, unpacked in memory that was asked for first."""

from __future__ import annotations

import bz2
import gzip
import io
import tarfile
import zipfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import BinaryIO, cast

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.readers.files_beside import FilesBeside, NamedFiles

ARCHIVES = (".zip", ".tar.gz", ".tgz", ".tar.bz2", ".bz2", ".gz")
"""How the names of archives end, longer endings first."""

PACKED_ALONE: dict[str, Callable] = {".gz": gzip.open, ".bz2": bz2.open}
"""Of a single file; what that names stands beside the archive."""

OWN_KINDS = ("3mf", "glb", "gltf", "obj", "off", "ply", "stl", "stl_ascii")
"""What our own readers read."""

MOST_MEMBERS = 10_000
"""Files in an archive: a directory entry is small in the archive and large in memory."""

CHUNK = 1 << 24
"""Bytes that are unpacked at a time."""


def archive_kind(path: str | Path) -> str | None:
    """How the file's name ends, if it is an archive's."""
    return next((ending for ending in ARCHIVES if str(path).lower().endswith(ending)), None)


def mesh_files(path: str) -> Iterator[tuple[bytes, str, NamedFiles]]:
    """Every mesh file in a file: (its bytes, its kind such as 'obj', the files beside it).

    Raises:
        InputError: an archive without mesh files or with too many files, or unpacked more than is allowed.
    """
    kind = archive_kind(path)
    if kind is None:
        budget.take(Path(path).stat().st_size, "the file")
        yield Path(path).read_bytes(), _kind(path), FilesBeside(path)
        return
    if kind in PACKED_ALONE:
        name = path[: -len(kind)]
        _check_kinds([name])
        with PACKED_ALONE[kind](path) as stream:
            yield _unpacked(cast(BinaryIO, stream)).getvalue(), _kind(name), FilesBeside(path)
        return
    members = _zip_members(path) if kind == ".zip" else _tar_members(path)
    from trimesh.resolvers import ZipResolver  # noqa: PLC0415  half a second, and few files are packed so

    beside = ZipResolver({name: io.BytesIO(data) for name, data in members.items()})
    for name in _check_kinds(members):
        yield members[name], _kind(name), beside


def kinds_inside(path: str) -> list[str]:
    """The kinds of the mesh files in a file, such as ['obj']; none where it cannot be read, which its reader says."""
    kind = archive_kind(path)
    if kind is None:
        return [_kind(path)]
    if kind in PACKED_ALONE:
        return [_kind(path[: -len(kind)])]
    try:
        with budget.account():
            return [_kind(name) for name in _check_kinds(_member_names(path) if kind == ".zip" else _tar_members(path))]
    except Exception:
        return []


def mesh_kinds() -> list[str]:
    """How the names of mesh files may end."""
    from trimesh.exchange.load import mesh_formats  # noqa: PLC0415  half a second

    return sorted({*mesh_formats(), *OWN_KINDS})


def is_mesh_kind(kind: str) -> bool:
    """Whether files whose names end so can be read. Of those of our own trimesh is not asked."""
    return kind in OWN_KINDS or kind in mesh_kinds()


def _check_kinds(names: Iterable[str]) -> list[str]:
    """Those of an archive's files that are meshes."""
    found = [name for name in names if is_mesh_kind(_kind(name)) and not _is_hidden(name)]
    if not found:
        raise InputError(f"no mesh file in the archive (read are {', '.join(mesh_kinds())})")
    return found


def _kind(name: str) -> str:
    return PurePosixPath(name).suffix.lower().lstrip(".")


def _is_hidden(name: str) -> bool:
    """Whether a file of an archive is one of those that macOS adds."""
    return any(part == "__MACOSX" or part.startswith("._") for part in PurePosixPath(name).parts)


def _member_names(path: str) -> list[str]:
    with zipfile.ZipFile(path) as archive:
        return [entry.filename for entry in archive.infolist()[: MOST_MEMBERS + 1]]


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
