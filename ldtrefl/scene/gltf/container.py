"""The container of a glTF asset: the JSON of a ``.gltf`` or ``.glb`` file, and the bytes of its buffers and pictures.

The names here are those of the glTF 2.0 specification (Khronos Group, 2021), whose sections are cited as "3.6.2". All
that is asked of the JSON goes through :class:`Document`, so that a fault names its place in the file.
"""

from __future__ import annotations

import base64
import binascii
import json
import sys
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf import meshopt
from ldtrefl.scene.readers.files_beside import Beside

MAGIC = b"glTF"
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
HEADER, CHUNK_HEADER = 12, 8

TEXT_BYTES = 4.0
"""Bytes that a byte of the JSON takes: it is decoded, and data in it are decoded once more."""

VALUE_BYTES = 250.0
"""Bytes that a value of the JSON takes: a name and a number, and what is made of it."""

LARGEST_NUMBER = sys.float_info.max
"""Numbers of the JSON are kept as float64."""

DEEPEST = 200
"""Lists and tables in one another in the JSON, at most: Python's own limit would be met at some thousand."""

COMPRESSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
"""Extensions of buffer views that are compressed."""

Table = dict[str, Any]
"""A JSON object."""


def is_glb(data: bytes) -> bool:
    """Whether a file is a binary one."""
    return data[:4] == MAGIC


class Document:
    """The JSON of an asset, with checked access to its arrays, and its buffers."""

    def __init__(self, data: bytes, beside: Beside) -> None:
        """Read the JSON.

        Args:
            data: the file, ``.gltf`` or ``.glb``.
            beside: reads the files that it names.

        Raises:
            InputError: it is no glTF 2.0.
        """
        text, self._binary = _chunks(data) if is_glb(data) else (data, None)
        values = text.count(b",") + text.count(b"{") + text.count(b"[")
        budget.take(TEXT_BYTES * len(text) + VALUE_BYTES * values, "its JSON")
        self.root = _parsed(text)
        self._beside = beside
        self._buffers: dict[int, bytes] = {}
        self._unpacked: dict[int, memoryview] = {}
        self._checked: set[str] = set()
        """The arrays of tables of the asset that are known to be that: they may be long, and be asked for often."""
        asset = self.table(self.root.get("asset"), "asset")
        version = asset.get("version")
        if not isinstance(version, str) or version.split(".")[0] != "2":
            raise InputError(f"asset.version: glTF 2.0 is read, got {_short(version)}")
        # Who cannot read that version must not read the asset (3.2).
        if asset.get("minVersion", "2.0") not in ("2", "2.0"):
            raise InputError(f"asset.minVersion: glTF 2.0 is read, got {_short(asset['minVersion'])}")

    def entry(self, kind: str, number: object, place: str) -> Table:
        """Entry ``number`` of the array called ``kind``, which ``place`` refers to.

        Raises:
            InputError: there is none.
        """
        entries = self.entries(kind)
        if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < len(entries):
            raise InputError(f"{place}: there is no {kind}[{_short(number)}] (the file has {len(entries)})")
        return entries[number]

    def entries(self, kind: str, *, of: Table | None = None, place: str = "") -> list[Table]:
        """The array of tables called ``kind``, of the asset or of a table ``of`` it; empty if there is none."""
        found = (self.root if of is None else of).get(kind, [])
        if of is None and kind in self._checked:
            return found  # type: ignore[no-any-return]
        where = f"{place}.{kind}" if place else kind
        if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
            raise InputError(f"{where}: should be a list of objects")
        if of is None:
            self._checked.add(kind)
        return found

    @staticmethod
    def table(value: object, place: str) -> Table:
        """A table; an empty one where nothing is given."""
        if value is None:
            return {}
        if not isinstance(value, dict):
            raise InputError(f"{place}: should be an object, got {_short(value)}")
        return value

    @staticmethod
    def whole(table: Table, key: str, place: str, default: int | None = None) -> int:
        """A whole number of 0 or more."""
        value = table.get(key, default)
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise InputError(f"{place}.{key}: should be a whole number of at least 0, got {_short(value)}")
        return value

    @staticmethod
    def number(table: Table, key: str, place: str, default: float) -> float:
        """A finite number."""
        return _number(table.get(key, default), f"{place}.{key}")

    @staticmethod
    def numbers(table: Table, key: str, place: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """As many finite numbers as ``default`` has."""
        value = table.get(key, default)
        if not isinstance(value, list | tuple) or len(value) != len(default):
            raise InputError(f"{place}.{key}: should be {len(default)} numbers, got {_short(value)}")
        return tuple(_number(one, f"{place}.{key}") for one in value)

    @staticmethod
    def name(table: Table) -> str:
        """The name of an entry, empty if it has none."""
        name = table.get("name", "")
        return name if isinstance(name, str) else ""

    def extension(self, table: Table, name: str, place: str) -> Table | None:
        """The table of an extension; None without it."""
        extensions = self.table(table.get("extensions"), f"{place}.extensions")
        return self.table(extensions[name], f"{place}.extensions.{name}") if name in extensions else None

    def buffer(self, number: object, place: str) -> bytes:
        """The bytes of a buffer (3.6.1), read once.

        Raises:
            InputError: there is none, or its file cannot be had.
        """
        entry = self.entry("buffers", number, place)
        assert isinstance(number, int)
        if number not in self._buffers:
            where = f"buffers[{number}]"
            uri = entry.get("uri")
            if uri is None and self._binary is not None and number == 0:
                found = self._binary
            elif uri is None:
                raise InputError(f"{where}: it has no 'uri', and there is no binary chunk for it")
            else:
                found = self.file(uri, f"{where}.uri")
            length = self.whole(entry, "byteLength", where)
            if len(found) < length:
                raise InputError(f"{where}: {length} bytes are announced, and {len(found)} are there")
            self._buffers[number] = found[:length] if len(found) > length else found
        return self._buffers[number]

    def view(self, number: object, place: str) -> memoryview:
        """The bytes of a buffer view (3.6.2).

        Raises:
            InputError: there is none, or it reaches beyond its buffer.
        """
        entry = self.entry("bufferViews", number, place)
        assert isinstance(number, int)
        where = f"bufferViews[{number}]"
        if number in self._unpacked:
            return self._unpacked[number]
        for name in COMPRESSIONS:
            packed = self.extension(entry, name, where)
            if packed is not None:
                at = f"{where}.extensions.{name}"
                count, stride = self.whole(packed, "count", at), self.whole(packed, "byteStride", at)
                found = meshopt.unpacked(self._slice(packed, at), count, stride, packed, at)
                self._unpacked[number] = memoryview(found)
                return self._unpacked[number]
        return self._slice(entry, where)

    def _slice(self, entry: Table, where: str) -> memoryview:
        """The bytes of a buffer that a table names."""
        first, length = self.whole(entry, "byteOffset", where, 0), self.whole(entry, "byteLength", where)
        buffer = self.buffer(entry.get("buffer"), f"{where}.buffer")
        if first + length > len(buffer):
            raise InputError(f"{where}: it ends at byte {first + length} of a buffer of {len(buffer)}")
        return memoryview(buffer)[first : first + length]

    def file(self, uri: object, place: str) -> bytes:
        """What a URI holds (2.8): data in itself, or a file of the asset's folder.

        Raises:
            InputError: it is neither, or cannot be read.
        """
        if not isinstance(uri, str):
            raise InputError(f"{place}: should be a text, got {_short(uri)}")
        if uri[:5].lower() == "data:":
            return _data_of(uri, place)
        if "://" in uri:
            raise InputError(f"{place}: only files beside it are read, got '{_short(uri)}'")
        try:
            return self._beside(unquote(uri))
        except InputError as error:
            raise error.within(place) from None
        except (OSError, ValueError) as error:
            raise InputError(f"{place}: no file '{_short(uri)}' beside it") from error


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    """(the JSON, the binary chunk if there is one) of a binary file (4.4)."""
    version, length = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8))
    if len(data) < HEADER + CHUNK_HEADER or version != 2:
        raise InputError(
            f"a binary glTF of version 2 is read, got version {version}" if len(data) >= 8 else "it is cut off"
        )
    end = min(length, len(data))
    if length > len(data):
        raise InputError(f"it is cut off: {length} bytes are announced, and {len(data)} are there")
    found: dict[int, bytes] = {}
    at = HEADER
    while at + CHUNK_HEADER <= end:
        size, kind = (int.from_bytes(data[at + k : at + k + 4], "little") for k in (0, 4))
        if at + CHUNK_HEADER + size > end:
            raise InputError(f"a chunk of {size} bytes at byte {at} reaches beyond the end, byte {end}")
        found.setdefault(kind, data[at + CHUNK_HEADER : at + CHUNK_HEADER + size])
        at += CHUNK_HEADER + size + -size % 4
    if JSON_CHUNK not in found:
        raise InputError("it has no JSON")
    # Spaces should fill it up (4.4.3.2), but some programs fill it up with zeros, as the binary chunk.
    return found[JSON_CHUNK].rstrip(b"\0"), found.get(BINARY_CHUNK)


def _parsed(text: bytes) -> Table:
    """The JSON as a table."""
    if _depth(text) > DEEPEST:
        raise InputError(f"its JSON has more than {DEEPEST} lists in one another")
    try:
        root = json.loads(text.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:  # no UTF-8 and no JSON are ValueErrors
        raise InputError(f"its JSON cannot be read ({_short(str(error))})") from error
    if not isinstance(root, dict):
        raise InputError("its JSON should be an object")
    return root


def _depth(text: bytes) -> int:
    """How many brackets are open at once at most; those in texts count, too."""
    depth = deepest = 0
    for bracket in text.translate(None, delete=bytes(set(range(256)) - set(b"[]{}"))):
        depth += 1 if bracket in b"[{" else -1
        deepest = max(deepest, depth)
    return deepest


def _data_of(uri: str, place: str) -> bytes:
    """The bytes of a data URI (RFC 2397)."""
    header, comma, body = uri.partition(",")
    if not comma:
        raise InputError(f"{place}: a data URI without data")
    try:
        if header.lower().endswith(";base64"):
            return base64.b64decode(unquote(body) if "%" in body else body, validate=False)
    except binascii.Error as error:
        raise InputError(f"{place}: its base64 is damaged") from error
    return unquote_to_bytes(body)


def _number(value: object, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST_NUMBER:
        raise InputError(f"{place}: should be a number, got {_short(value)}")
    return float(value)


def _short(value: object, limit: int = 60) -> str:
    """A value as it stands in the file, of at most ``limit`` characters."""
    try:
        text = value if isinstance(value, str) else json.dumps(value)
    except (ValueError, TypeError, RecursionError):
        text = type(value).__name__
    return text if len(text) <= limit else text[: limit - 3] + "..."
