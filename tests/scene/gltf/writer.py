"""glTF files written by hand, so that what stands in them is known."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

COMPONENTS = {"b": 5120, "B": 5121, "h": 5122, "H": 5123, "I": 5125, "f": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}

QUAD = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], np.float32)
"""Corners of a rectangle, counter-clockwise seen from +z."""
QUAD_FACES = np.array([0, 1, 2, 0, 2, 3], np.uint16)


class Written:
    """A glTF file that grows: buffers and views are added as accessors need them."""

    def __init__(self, **tree: Any) -> None:
        self.tree: dict[str, Any] = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], **tree}
        self.blob = b""

    def view(self, data: bytes, **more: Any) -> int:
        """Add bytes; the number of their buffer view."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.tree["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data), **more})
        self.blob += data
        return len(self.tree["bufferViews"]) - 1

    def accessor(self, array: np.ndarray, kind: str | None = None, **more: Any) -> int:
        """Add an array; the number of its accessor."""
        width = 1 if array.ndim == 1 else array.shape[1]
        entry = {
            "bufferView": self.view(np.ascontiguousarray(array).tobytes()),
            "componentType": COMPONENTS[array.dtype.char],
            "count": len(array),
            "type": kind or TYPES[width],
            **more,
        }
        self.tree["accessors"].append(entry)
        return len(self.tree["accessors"]) - 1

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Add an entry to one of the file's lists; its number."""
        self.tree.setdefault(kind, []).append(entry)
        return len(self.tree[kind]) - 1

    def mesh(self, attributes: dict[str, int], *, place: bool = True, **primitive: Any) -> int:
        """Add a mesh of one primitive, in a node of its own if ``place``; the mesh's number."""
        number = self.add("meshes", {"primitives": [{"attributes": attributes, **primitive}]})
        if place:
            self.add("nodes", {"mesh": number})
        return number

    def quad(self, **primitive: Any) -> int:
        """Add the rectangle."""
        attributes = {"POSITION": self.accessor(QUAD), **primitive.pop("attributes", {})}
        return self.mesh(attributes, indices=self.accessor(QUAD_FACES), **primitive)

    def as_json(self) -> bytes:
        """The file as JSON alone, its buffer in a data URI."""
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.blob).decode()
        return json.dumps({**self.tree, "buffers": [{"uri": uri, "byteLength": len(self.blob)}]}).encode()

    def as_glb(self) -> bytes:
        """The file in binary form."""
        header = json.dumps({**self.tree, "buffers": [{"byteLength": len(self.blob)}]}).encode()
        header += b" " * (-len(header) % 4)
        blob = self.blob + b"\0" * (-len(self.blob) % 4)
        length = 12 + 8 + len(header) + 8 + len(blob)
        return (
            struct.pack("<4sII", b"glTF", 2, length)
            + struct.pack("<I4s", len(header), b"JSON")
            + header
            + struct.pack("<I4s", len(blob), b"BIN\0")
            + blob
        )

    def save(self, folder: Path, name: str = "a.glb") -> Path:
        """Write the file; its path."""
        path = folder / name
        path.write_bytes(self.as_glb() if name.endswith(".glb") else self.as_json())
        return path


def nothing_beside(name: str) -> bytes:
    """What reads files beside one that has none."""
    raise FileNotFoundError(name)
