"""How much memory trimesh takes to read a mesh file: estimated from its size and its kind.

The figures are the highest of what was measured, with trimesh 5.2, for files of one million triangles and for the
shortest rows that a kind allows. Our own readers ask for what they take as they go.
"""

from __future__ import annotations

import zipfile
from io import BytesIO

STL = 5.0
"""Bytes per byte of a binary STL file; one of text takes twice as many."""

OTHER = 40.0
"""Bytes per byte of files of other kinds, most of which are XML."""


def reading_bytes(data: bytes, kind: str) -> float:
    """Bytes that it takes to read a mesh file with trimesh, besides the file itself, which is in ``data``.

    Args:
        data: the file.
        kind: how its name ends, such as 'stl'.
    """
    if kind in ("3dxml", "zae"):
        with zipfile.ZipFile(BytesIO(data)) as archive:
            return OTHER * sum(entry.file_size for entry in archive.infolist())
    if kind in ("stl", "stl_ascii"):
        return (2.0 if data[:5].lower() == b"solid" else 1.0) * STL * len(data)
    return OTHER * len(data)
