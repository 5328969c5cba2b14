"""Small mesh files written by hand, so that what stands in them is known."""

from __future__ import annotations

import bz2
import gzip
import io
import json
import struct
import tarfile
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

COMPONENTS = {"f": 5126, "H": 5123, "I": 5125}


def write_glb(path: Path, arrays: list[np.ndarray], **tree: Any) -> Path:
    """A GLB file whose accessors 0, 1, ... are float32 vectors or integer indices; ``tree`` holds the rest."""
    blob, views, accessors = b"", [], []
    for array in arrays:
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        kind = "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}"
        component = COMPONENTS[array.dtype.char]
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind})
        blob += array.tobytes() + b"\0" * (-array.nbytes % 4)
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
        **tree,
    }
    header = json.dumps(tree, separators=(",", ":")).encode()
    header += b" " * (-len(header) % 4)
    length = 20 + len(header) + 8 + len(blob)
    chunks = struct.pack("<4sIII4s", b"glTF", 2, length, len(header), b"JSON") + header
    path.write_bytes(chunks + struct.pack("<I4s", len(blob), b"BIN\0") + blob)
    return path


PLY_LETTERS = {
    "char": "b",
    "uchar": "B",
    "short": "h",
    "ushort": "H",
    "int": "i",
    "uint": "I",
    "float": "f",
    "double": "d",
}


def write_ply(path: Path, kind: str, tables: dict[str, tuple[list[str], list[list[Any]]]]) -> Path:
    """A PLY file of kind 'ascii', 'binary_little_endian' or 'binary_big_endian'.

    ``tables`` maps an element to (its properties as the header has them, less 'property'; rows of numbers and lists).
    """
    header = ["ply", f"format {kind} 1.0"]
    body = b""
    for name, (properties, rows) in tables.items():
        header += [f"element {name} {len(rows)}", *(f"property {entry}" for entry in properties)]
        for row in rows:
            body += _ply_row(kind, properties, row)
    path.write_bytes("\n".join([*header, "end_header", ""]).encode() + body)
    return path


def _ply_row(kind: str, properties: list[str], row: list[Any]) -> bytes:
    words, packed = [], b""
    order = ">" if "big" in kind else "<"
    for entry, value in zip(properties, row, strict=True):
        types = entry.split()[:-1]
        values = list(value) if types[0] == "list" else [value]
        if types[0] == "list":
            words.append(str(len(values)))
            packed += struct.pack(order + PLY_LETTERS[types[1]], len(values))
        words += map(str, values)
        packed += struct.pack(f"{order}{len(values)}{PLY_LETTERS[types[-1]]}", *values)
    return (" ".join(words) + "\n").encode() if kind == "ascii" else packed


def packed(path: Path, name: str, data: bytes) -> Path:
    """Write an archive with a file, of the kind that its name says."""
    if path.suffix == ".zip":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("readme.txt", "no mesh")
            archive.writestr(name, data)
    elif ".tar" in path.name:
        with tarfile.open(path, "w:gz" if path.suffix == ".gz" else "w:bz2") as archive:
            entry = tarfile.TarInfo(name)
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    else:
        path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else bz2.compress(data))
    return path
