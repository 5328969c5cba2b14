"""The format of a file of maps: named arrays and values, found to be whole before anything in it is used.

header   HEADER: magic, bytes of the file, bytes of the JSON, a hash of all that follows
JSON     {"arrays": name -> [dtype, shape, offset in the body], "values": ...}, padded with spaces
body     the arrays, each padded to ALIGNMENT bytes
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xxhash

ALIGNMENT = 64
"""Bytes: arrays begin at multiples of this, at a cache line."""

HEADER = struct.Struct("<8sQQQ")
"""Magic, length of the file, length of the JSON, hash of all that follows."""

MAGIC = b"ldtmaps\n"


@dataclass(frozen=True)
class Entry:
    """What a file holds."""

    arrays: dict[str, np.ndarray]
    """Read-only, in the memory that was read from."""
    values: dict[str, object]
    """What JSON can hold."""


def write_map_file(path: Path, arrays: Mapping[str, np.ndarray], values: Mapping[str, object]) -> None:
    """Write arrays, and values that JSON can hold, into a file. The header is written last.

    Raises:
        OSError: they cannot be written.
    """
    places, offset = {}, 0
    for name, array in arrays.items():
        places[name] = (array.dtype.str, array.shape, offset)
        offset += -(-array.nbytes // ALIGNMENT) * ALIGNMENT
    text = json.dumps({"arrays": places, "values": values}).encode()
    text += b" " * (-(HEADER.size + len(text)) % ALIGNMENT)
    digest = xxhash.xxh3_64(text)
    with path.open("wb") as file:
        file.write(HEADER.pack(MAGIC, 0, 0, 0))
        file.write(text)
        for array in arrays.values():
            data = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
            for part in (data.data, bytes(-data.nbytes % ALIGNMENT)):
                digest.update(part)
                file.write(part)
        file.seek(0)
        file.write(HEADER.pack(MAGIC, HEADER.size + len(text) + offset, len(text), digest.intdigest()))


def parse_map_file(content: memoryview) -> Entry:
    """The entry that a file's bytes hold. The arrays are views of them.

    Raises:
        Exception: of any kind, if the bytes are not what was written.
    """
    magic, length, text_length, digest = HEADER.unpack(content[: HEADER.size])
    if magic != MAGIC:
        raise ValueError("not a file of maps")
    if length != len(content):
        raise ValueError(f"{len(content)} of {length} bytes")
    if xxhash.xxh3_64_intdigest(content[HEADER.size :]) != digest:
        raise ValueError("its hash is another")
    held = json.loads(bytes(content[HEADER.size : HEADER.size + text_length]))
    body = content[HEADER.size + text_length :]
    arrays = {}
    for name, (dtype, shape, offset) in held["arrays"].items():
        count = int(np.prod(shape))
        arrays[name] = np.frombuffer(body, np.dtype(dtype), count, offset).reshape(shape)
    return Entry(arrays, held["values"])
