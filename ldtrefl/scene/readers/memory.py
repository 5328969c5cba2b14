"""How much memory it takes to read a mesh file: estimated from its size, its kind and what its header claims.

The figures are the highest of what was measured, with trimesh 5.2, for files of one million triangles and for the
shortest rows that a kind allows.
"""

from __future__ import annotations

import zipfile
from io import BytesIO

TEXT = 5.0
"""Bytes per byte of a text file; ``BYTES_PER_WORD`` comes on top."""

BYTES_PER_WORD = {"obj": 85.0, "ply": 125.0, "off": 150.0}
"""A word of a text file of triangles. A word ends with a blank, the line's end or a slash."""

BYTES_PER_WORD_WITH_POLYGONS = {"obj": 200.0, "ply": 230.0, "off": 150.0}
"""A word of a text file of polygons."""

BINARY = {"stl": 5.0, "ply": 5.0}
"""Bytes per byte of a binary file."""

BINARY_WITH_POLYGONS = 30.0
"""Bytes per byte of a binary PLY file of polygons."""

OTHER = 40.0
"""Bytes per byte of files of other kinds, most of which are XML."""


def reading_bytes(data: bytes, kind: str, *, polygons: bool) -> float:
    """Bytes that it takes to read a mesh file, besides the file itself, which is in ``data``.

    Args:
        data: the file.
        kind: how its name ends, such as 'obj'; not glTF's, whose reader asks for what it takes.
        polygons: it may hold polygons of more than three corners.
    """
    if kind in ("3mf", "3dxml", "zae"):
        with zipfile.ZipFile(BytesIO(data)) as archive:
            return OTHER * sum(entry.file_size for entry in archive.infolist())
    is_text = kind in ("obj", "off") or (kind == "ply" and b"ascii" in data[:64])
    if is_text:
        figures = BYTES_PER_WORD_WITH_POLYGONS if polygons else BYTES_PER_WORD
        return TEXT * len(data) + figures[kind] * sum(data.count(end) for end in (b" ", b"\n", b"/", b"\t"))
    if kind == "ply" and polygons:
        return BINARY_WITH_POLYGONS * len(data)
    if kind == "stl" and data[:5].lower() == b"solid":
        return 2.0 * BINARY["stl"] * len(data)
    return BINARY.get(kind, OTHER) * len(data)
