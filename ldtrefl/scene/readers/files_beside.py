"""The files beside a mesh file that it names, such as an MTL file and pictures; and whether they are still the same."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError

Beside = Callable[[str], bytes]
"""Reads one of them by the name that the mesh file has for it; asks for the memory first. It raises OSError or
ValueError where there is none."""

Stamp = tuple[int, int] | None
"""The time of a file's last change in nanoseconds, and its size; None where there is no such file."""


class NamedFiles(Protocol):
    """Where the files are that a mesh file names."""

    def get(self, name: str) -> bytes:
        """As ``Beside`` does."""


class FilesBeside:
    """Reads files of a mesh file's folder, plain ones alone, once the memory for them has been asked for.

    It remembers how those that were asked for stood before they were read, and which were missing.
    """

    def __init__(self, source: str) -> None:
        """Args:
        source: the mesh file.
        """
        self._parent = Path(source).resolve().parent
        self._stamps: dict[str, Stamp] = {}

    def get(self, name: str) -> bytes:
        """The bytes of a file.

        Raises:
            InputError: it is a pipe, a device or a folder, or too large.
            FileNotFoundError, ValueError: there is none, or it is not in the folder.
        """
        for candidate in (name.strip(), name.strip().lstrip("/"), Path(name).name):
            path = (self._parent / candidate).resolve()
            if not path.is_relative_to(self._parent):
                continue
            place = os.path.join(self._parent, candidate)
            self._stamps.setdefault(place, _stamp(place))
            if path.exists():
                if not path.is_file():
                    raise InputError(f"'{candidate}' beside it is not a file")
                budget.take(path.stat().st_size, f"'{candidate}' beside it")
                return path.read_bytes()
        if not (self._parent / name.strip()).resolve().is_relative_to(self._parent):
            raise ValueError(f"'{name}' is outside of its folder")
        raise FileNotFoundError(name)

    def are_as_read(self) -> bool:
        """Whether no file that was asked for has changed, come or gone since."""
        return all(_stamp(place) == stamp for place, stamp in self._stamps.items())


def _stamp(place: str) -> Stamp:
    try:
        status = os.stat(place)
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size
