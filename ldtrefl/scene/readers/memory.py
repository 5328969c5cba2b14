"""How much memory it takes to read a mesh file: estimated from its size, its kind and what its header claims.

The figures are the highest of what was measured, with trimesh 5.2, for files of one million triangles and for the
shortest rows that a kind allows.
"""

from __future__ import annotations

import zipfile
from io import BytesIO

from ldtrefl.scene.readers.ply_tables import is_of_one_length, read_header

TEXT = 5.0
"""Bytes per byte of a text file; ``BYTES_PER_WORD`` comes on top."""

BYTES_PER_WORD = {"obj": 110.0, "ply": 60.0, "off": 60.0}
"""A word of a text file. A word ends with a blank, the line's end or a slash."""

BINARY = {"stl": 5.0}
"""Bytes per byte of a binary file."""

PLY_OF_ONE_LENGTH, PLY_OF_MANY = 12.0, 60.0
"""The same of a PLY file whose lists have one length, and of one whose lists differ and are read one by one."""

OTHER = 40.0
"""Bytes per byte of files of other kinds, most of which are XML."""


def reading_bytes(data: bytes, kind: str) -> float:
    """Bytes that it takes to read a mesh file, besides the file itself, which is in ``data``.

    Args:
        data: the file.
        kind: how its name ends, such as 'obj'; not that of glTF and 3MF, whose readers ask for what they take.
    """
    if kind == "3mf":
        return 0.0
    if kind in ("3dxml", "zae"):
        with zipfile.ZipFile(BytesIO(data)) as archive:
            return OTHER * sum(entry.file_size for entry in archive.infolist())
    if kind == "ply":
        header = read_header(data)
        if header.order:
            return (PLY_OF_ONE_LENGTH if is_of_one_length(data, header) else PLY_OF_MANY) * len(data)
    if kind in BYTES_PER_WORD:
        words = sum(data.count(end) for end in (b" ", b"\n", b"/", b"\t"))
        return TEXT * len(data) + BYTES_PER_WORD[kind] * words
    if kind == "stl" and data[:5].lower() == b"solid":
        return 2.0 * BINARY["stl"] * len(data)
    return BINARY.get(kind, OTHER) * len(data)
