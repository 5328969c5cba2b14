"""NumPy's ``.npz`` archives from anybody: only the expected arrays are read, within the memory allowed."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import DTypeLike

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.files.trusted_files import open_plain

Kind = tuple[DTypeLike, tuple[int | None, ...]]
"""Type and shape of an array, None where any length will do."""

Expected = Mapping[str, Kind]
"""Name of an array -> its type and shape."""


def read_arrays(path: str | Path, expected: Expected) -> dict[str, np.ndarray]:
    """The expected arrays of an archive, by name. Whatever else it holds is not read.

    A small archive may unpack to more memory than any machine has. So the header of each array is read first, and the
    memory for all of them is asked for (``budget.py``) before anything is allocated.

    Raises:
        InputError: the file is missing, damaged, holds something else, or needs more memory than is allowed.
    """
    try:
        with os.fdopen(open_plain(path), "rb") as file, zipfile.ZipFile(file) as archive:
            needed = sum(_checked_bytes(archive, name, kind) for name, kind in expected.items())
            budget.take(needed, "unpacked it")
            return {name: _read(archive, name) for name in expected}
    except InputError:
        raise
    except Exception as error:  # whatever a damaged file provokes in a reader is the file's fault
        words = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise InputError(words) from error


def _checked_bytes(archive: zipfile.ZipFile, name: str, kind: Kind) -> int:
    """Bytes of an array, as its header says.

    Raises:
        ValueError, KeyError: it is missing, of another type or shape, or not as long as its header says.
    """
    dtype, wanted = np.dtype(kind[0]), kind[1]
    info = archive.getinfo(f"{name}.npy")
    with archive.open(info) as file:
        shape, found = _header(file)
        length = file.tell()
    fits = len(shape) == len(wanted) and all(n in (None, m) for n, m in zip(wanted, shape, strict=True))
    if found != dtype or not fits:
        raise ValueError(f"{name} is {found} of shape {shape}")
    needed = dtype.itemsize
    for n in shape:  # as Python's integers, which do not wrap around
        needed *= n
    if min(shape, default=0) < 0 or needed + length != info.file_size:
        raise ValueError(f"{name} is not as long as it says")
    return needed


def _header(file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype]:
    """(shape, type) of an array by its header; the file then stands behind that."""
    version = np.lib.format.read_magic(file)
    reader = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
    shape, _, dtype = reader(file)
    return shape, dtype


def _read(archive: zipfile.ZipFile, name: str) -> np.ndarray:
    """Unpack an array."""
    with archive.open(f"{name}.npy") as file:
        return np.asarray(np.lib.format.read_array(file, allow_pickle=False))
