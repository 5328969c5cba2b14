"""PLY files with polygons -> the same files with triangles.

A PLY file is a header and a table for each of its elements. The tables before the faces are kept as they are, the faces
are written anew, without properties but their corners and the corners' texture coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ldtrefl.scene.readers.polygons import triangles_of

PLY_TYPES = {
    **{"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2"},
    **{"uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8"},
    **{"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"},
}

FACES = "face"

VERTEX_LISTS = ("vertex_indices", "vertex_index")

CORNER_LIST = "texcoord"
"""A list of two numbers for each corner of a polygon."""


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str
    """NumPy's type."""
    length: str
    """The type of a list's length; '' if it is no list."""


@dataclass(frozen=True)
class _Element:
    """A table of a PLY file: a row for each vertex, face or the like."""

    name: str
    count: int
    properties: list[_Property]

    def row(self, lengths: dict[str, int]) -> np.dtype:
        """The type of a row whose lists, by name, have these lengths. A list's length is called 'n ' and its name."""
        fields: list[tuple[str, str, int] | tuple[str, str]] = []
        for entry in self.properties:
            if entry.length:
                fields += [(f"n {entry.name}", entry.length), (entry.name, entry.kind, lengths[entry.name])]
            else:
                fields.append((entry.name, entry.kind))
        return np.dtype(fields)

    @property
    def has_lists(self) -> bool:
        return any(entry.length for entry in self.properties)


_Lists = dict[str, tuple[np.ndarray, np.ndarray]]
"""A property's name -> the lengths of the lists of all rows, and what is in them, one after another."""


@dataclass(frozen=True)
class PlyFile:
    """Where a PLY file's vertices and faces are, and of what kinds their properties are."""

    data: bytes
    header: list[str]
    order: str
    """Of bytes: '<', '>', or '' for text."""
    vertices: _Element
    faces: _Element
    corners: str
    """The property that lists a face's vertices."""
    vertex_start: int
    """First byte, or first line after the header."""
    face_start: int
    begin: int
    """The first byte after the header."""

    @staticmethod
    def of(data: bytes) -> PlyFile | None:
        """The file's tables; None if it has no faces, or their place depends on lists that stand before them."""
        begin = data.find(b"\n", data.find(b"end_header")) + 1
        header = data[:begin].decode("utf-8", "replace").splitlines()
        elements, order = _ply_elements(header)
        names = [element.name for element in elements]
        if FACES not in names or "vertex" not in names[: names.index(FACES)]:
            return None
        place, vertex = names.index(FACES), names.index("vertex")
        faces, before = elements[place], elements[:place]
        corners = [entry.name for entry in faces.properties if entry.length and entry.name in VERTEX_LISTS]
        if not corners or any(element.has_lists for element in before):
            return None
        rows = [element.count * (element.row({}).itemsize if order else 1) for element in before]
        starts = np.cumsum([begin if order else 0, *rows]).tolist()
        return PlyFile(data, header, order, elements[vertex], faces, corners[0], starts[vertex], starts[place], begin)

    def is_of_triangles(self) -> bool:
        """Whether every face is a triangle. Where that would take reading the faces one by one, the answer is no."""
        if not self.faces.count:
            return True
        if self.order:
            alike = _lists_of_one_length(self.data, self.faces, self.face_start)
            return alike is not None and int(alike[0][self.corners][0][0]) == 3
        # In text a face's line most often begins with its number of corners.
        letters = np.frombuffer(self.data, np.uint8)
        lines = np.flatnonzero(letters[self.begin :] == ord("\n"))[self.face_start - 1 :][: self.faces.count]
        firsts = lines + self.begin + 1
        firsts = firsts[firsts + 1 < len(letters)]
        return bool(self.faces.properties[0].length) and bool(
            ((letters[firsts] == ord("3")) & (letters[firsts + 1] == ord(" "))).all()
        )

    def tables(self) -> tuple[np.ndarray, _Lists, bytes, bytes]:
        """(points, the faces' lists, what stands before the faces, what stands behind them)."""
        if self.order:
            table = np.frombuffer(self.data, self.vertices.row({}), self.vertices.count, self.vertex_start)
            points = np.stack([table[axis] for axis in "xyz"], 1).astype(np.float64)
            lists, end = _binary_lists(self.data, self.faces, self.face_start)
            return points, lists, self.data[self.begin : self.face_start], self.data[end:]
        lines = self.data[self.begin :].splitlines(keepends=True)
        columns = [[entry.name for entry in self.vertices.properties].index(axis) for axis in "xyz"]
        rows = [line.split() for line in lines[self.vertex_start : self.vertex_start + self.vertices.count]]
        points = np.array([[row[column] for column in columns] for row in rows], np.float64)
        end = self.face_start + self.faces.count
        lists = _text_lists(lines[self.face_start : end], self.faces)
        return points, lists, b"".join(lines[: self.face_start]), b"".join(lines[end:])


def ply_in_triangles(data: bytes) -> bytes:
    """A PLY file with triangles in the place of its polygons; faces of fewer than three corners are left out."""
    file = PlyFile.of(data)
    if file is None:
        return data
    points, lists, head, tail = file.tables()
    sizes, flat = lists[file.corners]
    is_polygon = sizes >= 3
    of_polygons = np.flatnonzero(np.repeat(is_polygon, sizes))
    corners = of_polygons[triangles_of(points[flat[of_polygons]], sizes[is_polygon])]
    pairs = None
    if CORNER_LIST in lists and np.array_equal(lists[CORNER_LIST][0], 2 * sizes):
        pairs = lists[CORNER_LIST][1].reshape(-1, 2)[corners].reshape(-1, 6)
    header = "\n".join(_ply_header(file.header, len(corners), pairs is not None)).encode()
    return header + b"\n" + head + _ply_triangles(flat[corners], pairs, file.order) + tail


def _ply_elements(header: list[str]) -> tuple[list[_Element], str]:
    """The tables, and the order of bytes: '<', '>', or '' for text."""
    elements: list[_Element] = []
    order = ""
    for words in (line.split() for line in header):
        if words[:1] == ["format"]:
            order = {"ascii": "", "binary_big_endian": ">"}.get(words[1], "<")
        elif words[:1] == ["element"]:
            elements.append(_Element(words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            kind, length = order + PLY_TYPES[words[3]], order + PLY_TYPES[words[2]]
            elements[-1].properties.append(_Property(words[4], kind, length))
        elif words[:1] == ["property"]:
            elements[-1].properties.append(_Property(words[2], order + PLY_TYPES[words[1]], ""))
    return elements, order


def _ply_header(header: list[str], triangles: int, has_pairs: bool) -> list[str]:
    """The header, with as many faces as there are triangles and no properties of faces but lists of their corners."""
    lines, is_face = [], False
    for line in header:
        words = line.split()
        if words[:1] == ["element"]:
            is_face = words[1] == FACES
            lines.append(f"element {FACES} {triangles}" if is_face else line)
            lines += ["property list uchar int vertex_indices"] if is_face else []
            lines += [f"property list uchar double {CORNER_LIST}"] if is_face and has_pairs else []
        elif not (is_face and words[:1] == ["property"]):
            lines.append(line)
    return lines


def _binary_lists(data: bytes, element: _Element, begin: int) -> tuple[_Lists, int]:
    """The lists of a table that begins at a byte of the file, and the byte at which it ends."""
    if alike := _lists_of_one_length(data, element, begin):
        return alike
    lists = [entry for entry in element.properties if entry.length]
    chunks: dict[str, list[bytes]] = {entry.name: [] for entry in lists}
    lengths: dict[str, list[int]] = {entry.name: [] for entry in lists}
    at = begin
    for _ in range(element.count):
        at = _binary_row(data, element, at, chunks, lengths)
    found = {name: np.frombuffer(b"".join(chunks[name]), kind) for name, kind in ((e.name, e.kind) for e in lists)}
    return {name: (np.array(lengths[name]), values) for name, values in found.items()}, at


def _binary_row(
    data: bytes, element: _Element, at: int, chunks: dict[str, list[bytes]], lengths: dict[str, list[int]]
) -> int:
    """Add the lists of a row that starts at a byte; the byte at which it ends."""
    for entry in element.properties:
        length = 1
        if entry.length:
            length = int(np.frombuffer(data, entry.length, 1, at)[0])
            at += int(entry.length[-1])
            chunks[entry.name].append(data[at : at + length * int(entry.kind[-1])])
            lengths[entry.name].append(length)
        at += length * int(entry.kind[-1])
        if length < 0 or at > len(data):
            raise ValueError(f"the file ends among its rows of '{element.name}'")
    return at


def _lists_of_one_length(data: bytes, element: _Element, begin: int) -> tuple[_Lists, int] | None:
    """What :func:`_binary_lists` gives, for a table whose rows all have lists of the same lengths; None for others."""
    chunks: dict[str, list[bytes]] = {entry.name: [] for entry in element.properties}
    lengths: dict[str, list[int]] = {entry.name: [] for entry in element.properties if entry.length}
    if not element.count or _binary_row(data, element, begin, chunks, lengths) > len(data):
        return None
    first = {name: found[0] for name, found in lengths.items()}
    row = element.row(first)
    end = begin + element.count * row.itemsize
    if end > len(data):
        return None
    table = np.frombuffer(data, row, element.count, begin)
    if not all((table[f"n {name}"] == length).all() for name, length in first.items()):
        return None
    return {name: (np.full(element.count, size), table[name].reshape(-1)) for name, size in first.items()}, end


def _text_lists(lines: list[bytes], element: _Element) -> _Lists:
    """The lists of a table of text, a line for each row."""
    words: dict[str, list[bytes]] = {entry.name: [] for entry in element.properties if entry.length}
    lengths: dict[str, list[int]] = {name: [] for name in words}
    for row in (line.split() for line in lines):
        at = 0
        for entry in element.properties:
            if entry.length:
                length = int(row[at])
                words[entry.name] += row[at + 1 : at + 1 + length]
                lengths[entry.name].append(length)
                at += length
            at += 1
    kinds = {entry.name: np.int64 if entry.kind[-2] in "iu" else np.float64 for entry in element.properties}
    return {name: (np.array(lengths[name]), np.array(words[name]).astype(kinds[name])) for name in words}


def _ply_triangles(corners: np.ndarray, pairs: np.ndarray | None, order: str) -> bytes:
    """The table of the triangles, whose corners are (m, 3) numbers of vertices and, if given, (m, 6) texture
    coordinates."""
    fields: list[tuple] = [("n", "u1"), ("corners", f"{order or '<'}i4", 3)]
    fields += [] if pairs is None else [("n pairs", "u1"), ("pairs", f"{order or '<'}f8", 6)]
    table = np.zeros(len(corners), fields)
    table["n"], table["corners"] = 3, corners
    if pairs is not None:
        table["n pairs"], table["pairs"] = 6, pairs
    if order:
        return table.tobytes()
    rows = [["3", *map(str, row)] for row in corners.tolist()]
    if pairs is not None:
        rows = [[*row, "6", *map(repr, pair)] for row, pair in zip(rows, pairs.tolist(), strict=True)]
    return "".join(" ".join(row) + "\n" for row in rows).encode()
