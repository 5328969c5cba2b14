"""How much memory it takes to read a mesh file: estimated from its size, its kind and what its header claims.

The figures are the highest of what was measured, with trimesh 5.2, for files of one million triangles and for the
shortest rows that a kind allows.
"""

from __future__ import annotations

import json
import zipfile
from io import BytesIO
from typing import Any

BYTES_PER_VERTEX = 160.0
"""A vertex while pieces are joined, welded and smoothed, the mesh itself included."""

BYTES_PER_TRIANGLE = 90.0
"""A triangle, likewise."""

TEXT = 5.0
"""Bytes per byte of a text file; ``BYTES_PER_WORD`` comes on top."""

BYTES_PER_WORD = {"obj": 85.0, "ply": 125.0, "off": 150.0}
"""A word of a text file of triangles. A word ends with a blank, the line's end or a slash."""

BYTES_PER_WORD_WITH_POLYGONS = {"obj": 200.0, "ply": 230.0, "off": 150.0}
"""A word of a text file of polygons."""

BINARY = {"stl": 5.0, "ply": 5.0, "glb": 4.0}
"""Bytes per byte of a binary file."""

BINARY_WITH_POLYGONS = 30.0
"""Bytes per byte of a binary PLY file of polygons."""

OTHER = 40.0
"""Bytes per byte of files of other kinds, most of which are XML."""

JSON = 60.0
"""Bytes per byte of the JSON in a glTF file: its nodes and primitives become objects."""

# glTF's names of the types of numbers, and of the tuples that they make.
COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def reading_bytes(data: bytes, kind: str, *, polygons: bool) -> float:
    """Bytes that it takes to read a mesh file, besides the file itself, which is in ``data``.

    Args:
        data: the file.
        kind: how its name ends, such as 'obj' or 'glb'.
        polygons: it may hold polygons of more than three corners.
    """
    if kind in ("glb", "gltf"):
        return _gltf_bytes(data, kind)
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


def _gltf_bytes(data: bytes, kind: str) -> float:
    """Bytes for a glTF file: trimesh copies every view and every accessor, and makes accessors without a view of
    zeros."""
    header = data
    if kind == "glb":
        length = int.from_bytes(data[12:16], "little")
        header = data[20 : 20 + length]
    needed = BINARY["glb"] * len(data) + JSON * len(header)
    try:
        tree = json.loads(header)
        needed += sum(_length(view["byteLength"]) for view in tree.get("bufferViews", []))
        needed += 2.0 * sum(map(_accessor_bytes, tree.get("accessors", [])))
        needed += BINARY["glb"] * sum(
            _length(buffer["byteLength"]) for buffer in tree.get("buffers", []) if "uri" in buffer
        )
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        pass  # the reader says what is wrong
    return needed


def _accessor_bytes(accessor: dict[str, Any]) -> float:
    kind, items = COMPONENT_BYTES[accessor["componentType"]], COMPONENTS[accessor["type"]]
    return kind * items * _length(accessor["count"])


def _length(value: float) -> float:
    return max(0.0, float(value))
