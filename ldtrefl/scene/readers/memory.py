"""How much memory trimesh takes to read a mesh file: estimated from its size and its kind.

The figure is the highest of what was measured, with trimesh 5.2, for files of one million triangles and for the
shortest rows that a kind allows. Our own readers ask for what they take as they go.
"""

from __future__ import annotations

import zipfile
from io import BytesIO

BYTES_PER_BYTE = 40.0
"""Bytes per byte of a file, most of which are XML."""


def reading_bytes(data: bytes, kind: str) -> float:
    """Bytes that it takes to read a mesh file with trimesh, besides the file itself, which is in ``data``.

    Args:
        data: the file.
        kind: how its name ends, such as 'dae'.
    """
    if kind in ("3dxml", "zae"):
        with zipfile.ZipFile(BytesIO(data)) as archive:
            return BYTES_PER_BYTE * sum(entry.file_size for entry in archive.infolist())
    return BYTES_PER_BYTE * len(data)
