"""Mesh files with polygons -> the same files with triangles.

The reader behind cuts every polygon from its first corner, gives triangles of different polygons in another order than
the file's, and refuses binary PLY files whose polygons differ in size. So a file that has polygons of more than three
corners is written anew in memory, each polygon replaced by its triangles. Files of triangles pass as they are.
"""

from __future__ import annotations

import re
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


OBJ_POLYGON = re.compile(rb"^[ \t]*f(?:[ \t]+[^\s#]+){4}|^[ \t]*f[^\n#]*-", re.MULTILINE)
"""A face of four corners, or one with relative numbers."""


def has_polygons(data: bytes, kind: str) -> bool:
    """Whether a mesh file of some kind may hold polygons of more than three corners. Takes little memory."""
    if kind == "obj":
        return OBJ_POLYGON.search(data) is not None or b"\\\n" in data or b"\\\r" in data
    if kind == "ply":
        table = _PlyFile.of(data)
        return table is not None and not table.is_of_triangles()
    return kind == "off"


def in_triangles(data: bytes, kind: str) -> bytes:
    """A mesh file that may have polygons with triangles in their place."""
    return {"obj": _obj, "off": _off, "ply": _ply}[kind](data)


def _obj(data: bytes) -> bytes:
    """Relative numbers of vertices become absolute ones, too."""
    lines = data.replace(b"\r\n", b"\n").replace(b"\\\n", b"").split(b"\n")
    counts = {b"v": 0, b"vt": 0, b"vn": 0}
    faces: list[int] = []
    flat: list[bytes] = []
    sizes: list[int] = []
    vertices: list[bytes] = []
    for number, line in enumerate(lines):
        kind, _, rest = line.strip().partition(b" ")
        if kind == b"f":
            corners = rest.partition(b"#")[0].split()
            if b"-" in rest:
                corners = [_absolute(corner, tuple(counts.values())) for corner in corners]
            if len(corners) >= 3:
                faces.append(number)
                flat += corners
                sizes.append(len(corners))
        elif kind in counts:
            counts[kind] += 1
            if kind == b"v":
                vertices.append(rest)
    points = np.array([line.split()[:3] for line in vertices], np.float64)
    numbers = np.array([int(corner.partition(b"/")[0]) - 1 for corner in flat])
    triangles = triangles_of(points[numbers], np.array(sizes))
    k = 0
    for number, size in zip(faces, sizes, strict=True):
        rows = triangles[k : k + size - 2].tolist()
        lines[number] = b"\n".join(b"f " + b" ".join(flat[corner] for corner in row) for row in rows)
        k += size - 2
    return b"\n".join(lines)


def _absolute(corner: bytes, counts: tuple[int, ...]) -> bytes:
    """A corner's numbers of vertex, texture coordinate and normal, counted from 1 in place of from the end."""
    numbers = corner.split(b"/")
    for k, number in enumerate(numbers):
        if number.startswith(b"-"):
            numbers[k] = str(counts[k] + 1 + int(number)).encode()
    return b"/".join(numbers)


def _off(data: bytes) -> bytes:
    lines = [line for line in (line.partition(b"#")[0].strip() for line in data.splitlines()) if line]
    # The counts stand behind the word or below it.
    word, _, behind = lines[0].partition(b" ")
    if word not in (b"OFF", b"COFF"):
        return data
    rows = ([behind] if behind else []) + lines[1:]
    vertex_count, polygon_count = (int(number) for number in rows[0].split()[:2])
    head, body = rows[1 : 1 + vertex_count], rows[1 + vertex_count : 1 + vertex_count + polygon_count]
    polygons = [row.split() for row in body]
    sizes = np.array([int(row[0]) for row in polygons])
    if not (sizes > 3).any():
        return data
    polygons = [row[1 : 1 + size] for row, size in zip(polygons, sizes.tolist(), strict=True) if size >= 3]
    flat = np.array([int(number) for row in polygons for number in row])
    points = np.array([row.split()[:3] for row in head], np.float64)
    triangles = flat[triangles_of(points[flat], sizes[sizes >= 3])]
    body = [b"3 %d %d %d" % tuple(row) for row in triangles.tolist()]
    return b"\n".join([word, b"%d %d 0" % (vertex_count, len(body)), *head, *body, b""])


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
        """A row whose lists are so long; a list's length is called 'n ' and its name."""
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
class _PlyFile:
    """A PLY file's tables up to its faces."""

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
    def of(data: bytes) -> _PlyFile | None:
        """None if the file has no faces, or not where they can be found."""
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
        return _PlyFile(data, header, order, elements[vertex], faces, corners[0], starts[vertex], starts[place], begin)

    def is_of_triangles(self) -> bool:
        """Whether every face is one, as far as can be seen without reading them all one by one."""
        if not self.faces.count:
            return True
        if self.order:
            alike = _alike(self.data, self.faces, self.face_start)
            return alike is not None and int(alike[0][self.corners][0][0]) == 3
        # In text the count comes first, if it does.
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


def _ply(data: bytes) -> bytes:
    file = _PlyFile.of(data)
    if file is None:
        return data
    points, lists, head, tail = file.tables()
    sizes, flat = lists[file.corners]
    is_kept = sizes >= 3
    kept = np.flatnonzero(np.repeat(is_kept, sizes))
    corners = kept[triangles_of(points[flat[kept]], sizes[is_kept])]
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
    """The header for so many triangles, which have no properties but lists of their corners."""
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
    if alike := _alike(data, element, begin):
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


def _alike(data: bytes, element: _Element, begin: int) -> tuple[_Lists, int] | None:
    """:func:`_binary_lists` of a table whose rows all have lists of the same lengths; None if they have not."""
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
    """The rows of a table of triangles: (m, 3) numbers of vertices, and (m, 6) texture coordinates if there are any."""
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
