"""The tables of a PLY file: a row for each vertex, face or the like.

A file is a header, which says what a row of each table holds, and the tables one after another, as text or as bytes of
either order. A row holds numbers and lists of numbers (Greg Turk, "The PLY Polygon File Format", 1994).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.readers.text_numbers import Lines

PLY_TYPES = {
    **{"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2"},
    **{"uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8"},
    **{"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"},
}

LETTERS = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f4": "f", "f8": "d"}
"""NumPy's types in the terms of ``struct``."""

FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

BYTES_PER_TEXT_BYTE = 25.0
"""What a byte of a table of text takes while it is read; measured."""

BYTES_PER_ENTRY = 150.0
"""The same of a property of a row that is read by itself."""

LONGEST_HEADER = 1 << 20
"""Bytes."""


@dataclass(frozen=True)
class Property:
    """What a row holds, by its name."""

    name: str
    kind: str
    """NumPy's type of its numbers, without the order of bytes."""
    length: str
    """The type of a list's length; '' if it is a single number."""


@dataclass
class Element:
    """What the header says of a table."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    def row(self, order: str, lengths: dict[str, int]) -> np.dtype:
        """The type of a row whose lists, by name, have these lengths. A list's length is called 'n ' and its name."""
        fields: list[tuple[str, str, int] | tuple[str, str]] = []
        for entry in self.properties:
            if entry.length:
                fields.append((f"n {entry.name}", order + entry.length))
                fields.append((entry.name, order + entry.kind, lengths[entry.name]))
            else:
                fields.append((entry.name, order + entry.kind))
        return np.dtype(fields)

    @property
    def lists(self) -> list[Property]:
        """Those of its properties that are lists."""
        return [entry for entry in self.properties if entry.length]


@dataclass
class Table:
    """A table that was read."""

    element: Element
    columns: dict[str, np.ndarray]
    """Single numbers: (rows,) of the file's type."""
    lists: dict[str, tuple[np.ndarray, np.ndarray]]
    """(rows,) int64, how long the list of each row is, and what is in them, one after another."""

    def kind(self, name: str) -> str:
        """NumPy's type of a property."""
        return next(entry.kind for entry in self.element.properties if entry.name == name)


@dataclass(frozen=True)
class Header:
    """The header of a file."""

    order: str
    """Of bytes: '<', '>', or '' for text."""
    elements: list[Element]
    comments: list[str]
    end: int
    """The first byte behind it."""
    lines: int
    """How many it has."""


def read_header(data: bytes) -> Header:
    """The header of a PLY file.

    Raises:
        InputError: it is none, or a line of it is wrong.
    """
    mark = data.find(b"end_header", 0, LONGEST_HEADER)
    if data[:3] != b"ply" or mark < 0:
        raise InputError("not a PLY file: it should begin with 'ply' and have a line 'end_header'")
    behind = mark + len(b"end_header")
    # Lines end with a line feed, a carriage return or both, which the first tells: behind the last any byte may stand.
    end = behind + (2 if data[3:5] == b"\r\n" else 1)
    lines = data[:mark].decode("utf-8", "replace").splitlines()
    order, elements, comments = "", [], []
    for number, line in enumerate(lines, 1):
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = FORMATS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(Element(words[1], _count(words[2])))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append(Property(words[4], PLY_TYPES[words[3]], PLY_TYPES[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(Property(words[2], PLY_TYPES[words[1]], ""))
            elif words[:1] == ["comment"]:
                comments.append(line.strip()[len("comment") :].strip())
        except (LookupError, ValueError) as error:
            raise InputError(f"line {number} of the header is wrong: '{line[:60]}'") from error
    for element in elements:
        names = [entry.name for entry in element.properties]
        if len(set(names)) < len(names) or any(entry.length[:1] == "f" for entry in element.properties):
            raise InputError(f"the header describes '{element.name}' wrongly")
    return Header(order, elements, comments, end, len(lines) + 1)


def _count(word: str) -> int:
    count = int(word)
    if count < 0:
        raise ValueError
    return count


def read_tables(data: bytes, header: Header) -> dict[str, Table]:
    """All tables by their names.

    Raises:
        InputError: the file ends among them or holds what its header does not say, or they take more memory than is
            allowed.
    """
    return _text_tables(data, header) if not header.order else _binary_tables(data, header)


def _binary_tables(data: bytes, header: Header) -> dict[str, Table]:
    tables, at = {}, header.end
    for element in header.elements:
        lengths = _first_lengths(data, element, header.order, at)
        if lengths is not None and _same_lengths(data, element, header.order, at, lengths):
            tables[element.name], at = _rows_alike(data, element, header.order, at, lengths)
        else:
            tables[element.name], at = _rows_one_by_one(data, element, header.order, at)
    return tables


def _first_lengths(data: bytes, element: Element, order: str, at: int) -> dict[str, int] | None:
    """How long the lists of the first row are; None if the file ends before."""
    lengths: dict[str, int] = {}
    if not element.count:
        return dict.fromkeys((entry.name for entry in element.lists), 0)
    for entry in element.properties:
        count = 1
        if entry.length:
            size = int(entry.length[1])
            if at + size > len(data):
                return None
            count = lengths[entry.name] = int(np.frombuffer(data, order + entry.length, 1, at)[0])
            at += size
        at += count * int(entry.kind[1])
        if count < 0 or at > len(data):
            return None
    return lengths


def _same_lengths(data: bytes, element: Element, order: str, at: int, lengths: dict[str, int]) -> bool:
    row = element.row(order, lengths)
    if at + element.count * row.itemsize > len(data):
        if not lengths:
            raise _ends_early(element)
        return False
    if not lengths or not element.count:
        return True
    table = np.frombuffer(data, row, element.count, at)
    return all(bool((table[f"n {name}"] == length).all()) for name, length in lengths.items())


def _rows_alike(data: bytes, element: Element, order: str, at: int, lengths: dict[str, int]) -> tuple[Table, int]:
    row = element.row(order, lengths)
    # Rows without anything in them take nothing, however many there are.
    table = np.frombuffer(data, row, element.count if row.itemsize else 0, at)
    lists = {name: (np.full(element.count, length), table[name].reshape(-1)) for name, length in lengths.items()}
    columns = {entry.name: table[entry.name] for entry in element.properties if not entry.length}
    return Table(element, columns, lists), at + element.count * row.itemsize


def _rows_one_by_one(data: bytes, element: Element, order: str, at: int) -> tuple[Table, int]:
    chunks: dict[str, list[bytes]] = {entry.name: [] for entry in element.properties}
    lengths: dict[str, list[int]] = {entry.name: [] for entry in element.lists}
    steps = [
        (entry.name, int(entry.kind[1]), struct.Struct(order + LETTERS[entry.length]) if entry.length else None)
        for entry in element.properties
    ]
    if element.count > len(data) - at:
        raise _ends_early(element)
    budget.take(BYTES_PER_ENTRY * element.count * len(steps), f"{element.count} rows of '{element.name}'")
    for _ in range(element.count):
        for name, size, length in steps:
            count = 1
            if length is not None:
                if at + length.size > len(data):
                    raise _ends_early(element)
                (count,) = length.unpack_from(data, at)
                at += length.size
                lengths[name].append(count)
            end = at + count * size
            if count < 0 or end > len(data):
                raise _ends_early(element)
            chunks[name].append(data[at:end])
            at = end
    found = {e.name: np.frombuffer(b"".join(chunks[e.name]), order + e.kind) for e in element.properties}
    lists = {name: (np.array(lengths[name], np.int64), found[name]) for name in lengths}
    return Table(element, {name: values for name, values in found.items() if name not in lists}, lists), at


def _text_tables(data: bytes, header: Header) -> dict[str, Table]:
    budget.take(BYTES_PER_TEXT_BYTE * len(data), "its tables")
    body = data[header.end :].replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\t", b" ")
    lines = Lines.of(body if body.endswith(b"\n") else body + b"\n", header.lines + 1)
    has_words = np.flatnonzero(lines.ends > lines.starts)
    tables, at = {}, 0
    for element in header.elements:
        if at + element.count > len(has_words):
            raise _ends_early(element)
        chosen = np.zeros(len(lines.starts), bool)
        chosen[has_words[at : at + element.count]] = True
        values, words = lines.rows(chosen, 0, least=0)
        tables[element.name] = _text_table(element, values, words)
        at += element.count
    return tables


def _text_table(element: Element, values: np.ndarray, words: np.ndarray) -> Table:
    """A table of the numbers of its rows, one row after another, and how many each has."""
    ends = np.cumsum(words)
    place = ends - words
    columns, lists = {}, {}
    for entry in element.properties:
        if (place >= ends).any():
            raise InputError(f"row {int(np.argmax(place >= ends))} of '{element.name}' has too few numbers")
        if not entry.length:
            columns[entry.name] = values[place].astype(entry.kind)
            place = place + 1
            continue
        lengths = values[place]
        is_wrong = ~((lengths >= 0) & (lengths <= ends - place - 1))
        if is_wrong.any():
            raise InputError(f"row {int(np.argmax(is_wrong))} of '{element.name}' has a list of wrong length")
        lengths = lengths.astype(np.int64)
        before = np.cumsum(lengths) - lengths
        inside = np.arange(int(lengths.sum())) - np.repeat(before, lengths)
        lists[entry.name] = (lengths, values[np.repeat(place + 1, lengths) + inside].astype(entry.kind))
        place = place + 1 + lengths
    return Table(element, columns, lists)


def _ends_early(element: Element) -> InputError:
    return InputError(f"the file ends among its {element.count} rows of '{element.name}'")
