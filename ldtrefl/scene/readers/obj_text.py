"""The text of an OBJ file -> its tables: positions, texture coordinates, normals, and the corners of its faces.

A block of lines is read at a time. The lines of each kind are picked out of it together, and NumPy reads their numbers
at once: there is no step of Python for each line but those that name a material, a file or the like.

The format is that of Wavefront's "Advanced Visualizer" manual, appendix B1. What programs write beyond it and is read:
colours behind positions (``v x y z r g b``), and comments behind statements.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.readers.byte_order_marks import without_mark
from ldtrefl.scene.readers.text_numbers import Lines

BLOCK = 1 << 20
"""Bytes of text that are read at a time, up to the next end of a line."""

BYTES_PER_TEXT_BYTE = 50.0
"""What a byte of a block takes while the block is read; measured."""

LONGEST_LINE = 1 << 24
"""Bytes: what is longer, continued lines joined, is no line of numbers that anybody wrote."""

NEVER_SAID = (1 << 30) - 1
"""The smoothing group of faces in a file without statements of smoothing; those of statements have nine digits."""

CONTINUED = re.compile(rb"(?:[^\n]*\\\n)+[^\n]*\n")
COMMENT = re.compile(rb"(?:^|(?<= ))#[^\n]*", re.MULTILINE)
INDENT = re.compile(rb"^ +", re.MULTILINE)
BLANKS = bytes.maketrans(b"\t\v\f\r\0", b"     ")

WITHOUT_EFFECT = (b"o", b"g")
"""Names of objects and groups: materials make the parts."""

NOT_SHOWN = {
    **dict.fromkeys((b"l", b"p"), "points and lines (they have no surface)"),
    **dict.fromkeys((b"vp", b"cstype", b"deg", b"curv", b"curv2", b"surf", b"parm", b"end"), "curved surfaces"),
}
"""Statements whose meaning is known."""

MOST_NAMED = 8
"""Kinds of other statements that are named."""


@dataclass(eq=False)
class ObjTables:
    """What an OBJ file says."""

    positions: np.ndarray
    """(n, 3) float64."""
    colors: np.ndarray | None
    """(n, 4) float64 as they stand in the file; None if no position has a colour. Positions without one are white."""
    uvs: np.ndarray
    """(t, 2) float64, v = 0 at the bottom."""
    normals: np.ndarray
    """(k, 3) float64."""
    sizes: np.ndarray
    """(f,) int32: corners of each face."""
    corners: np.ndarray
    """(c, 3) int32: the numbers, from 0, of each corner's position, texture coordinates and normal; -1 for none."""
    lines: np.ndarray
    """(f,) int32: the line that each face stands in, from 1."""
    materials: np.ndarray
    """(f,) int32: which of ``material_names`` each face has."""
    smoothing: np.ndarray
    """(f,) int32: the smoothing group of each face; 0 for none, :data:`NEVER_SAID`."""
    material_names: list[str]
    """The first, '', stands for none."""
    libraries: list[str]
    """What stands behind each ``mtllib``."""
    not_shown: list[str]
    """What else the file holds."""


_TABLES: dict[str, np.ndarray] = {
    "positions": np.zeros((0, 3)),
    "colors": np.zeros((0, 4)),
    "uvs": np.zeros((0, 2)),
    "normals": np.zeros((0, 3)),
    "sizes": np.zeros(0, np.int32),
    "corners": np.zeros((0, 3), np.int32),
    "lines": np.zeros(0, np.int32),
    "materials": np.zeros(0, np.int32),
    "smoothing": np.zeros(0, np.int32),
}
"""The tables that are read, when empty."""


@dataclass(eq=False)
class _Reader:
    """What has been read so far."""

    counts: np.ndarray = field(default_factory=lambda: np.zeros(3, np.int64))
    """Of positions, texture coordinates and normals."""
    tables: dict[str, list[np.ndarray]] = field(default_factory=lambda: {name: [] for name in _TABLES})
    names: dict[str, int] = field(default_factory=lambda: {"": 0})
    libraries: list[str] = field(default_factory=list)
    material: int = 0
    smoothing: int = NEVER_SAID
    has_colors: bool = False
    others: dict[str, None] = field(default_factory=dict)

    def read(self, block: bytes, first_line: int) -> int:
        """Read a block of whole lines, whose first has this number; the number of the line behind it."""
        lines = Lines.of(_plain(block), first_line)
        a, b, c = (lines.letters(k) for k in range(3))
        blank = ord(" ")
        is_v = (a == ord("v")) & (b == blank)
        is_vt = (a == ord("v")) & (b == ord("t")) & (c == blank)
        is_vn = (a == ord("v")) & (b == ord("n")) & (c == blank)
        is_f = (a == ord("f")) & (b == blank)
        switches = self._statements(lines, np.flatnonzero(~(is_v | is_vt | is_vn | is_f) & (a != ord("\n"))))
        before = np.stack([np.cumsum(of) for of in (is_v, is_vt, is_vn)], 1) + self.counts
        self._positions(lines, is_v)
        self.tables["uvs"].append(_columns(*lines.rows(is_vt, 2, least=1), 2, 0.0))
        self.tables["normals"].append(_columns(*lines.rows(is_vn, 2, least=3), 3, 0.0))
        if is_f.any():
            self._faces(lines, is_f, before[is_f], switches)
        if len(before):
            self.counts = before[-1]
        return first_line + len(lines.starts)

    def _positions(self, lines: Lines, chosen: np.ndarray) -> None:
        values, words = lines.rows(chosen, 1, least=3)
        self.tables["positions"].append(_columns(values, words, 3, 0.0))
        if (words >= 6).any():
            if not self.has_colors:
                self.has_colors = True
                self.tables["colors"] = [np.ones((len(rows), 4)) for rows in self.tables["positions"][:-1]]
            colors = _columns(values, words, 7, 1.0)[:, 3:]
            colors[words < 6] = 1.0
            self.tables["colors"].append(colors)
        elif self.has_colors:
            self.tables["colors"].append(np.ones((len(words), 4)))

    def _faces(self, lines: Lines, chosen: np.ndarray, counts: np.ndarray, switches: _Switches) -> None:
        """Faces of a block. ``counts`` says how many positions and so on stand before each."""
        given, sizes = lines.corners(chosen)
        if (given < 0).any():
            counts = np.repeat(counts, sizes, axis=0)
            absolute = np.where(given > 0, given - 1, np.where(given < 0, counts + given, -1))
            is_wrong = (given < 0) & (absolute < 0)
        else:
            absolute, is_wrong = given - 1, np.zeros(given.shape, bool)
        is_wrong[:, 0] |= given[:, 0] == 0
        numbers_of = lines.first + np.flatnonzero(chosen)
        if is_wrong.any():
            corner, k = (int(place[0]) for place in np.nonzero(is_wrong))
            face = int(np.searchsorted(np.cumsum(sizes), corner, side="right"))
            what = ("vertex", "texture coordinates", "normal")[k]
            raise InputError(f"line {numbers_of[face]}: there is no {what} {given[corner, k]}")
        self.tables["sizes"].append(sizes.astype(np.int32))
        self.tables["corners"].append(np.minimum(absolute, np.iinfo(np.int32).max).astype(np.int32))
        self.tables["lines"].append(numbers_of.astype(np.int32))
        self.tables["materials"].append(switches.materials_at(numbers_of))
        self.tables["smoothing"].append(switches.smoothing_at(numbers_of))

    def _statements(self, lines: Lines, chosen: np.ndarray) -> _Switches:
        """Lines of other kinds: which material and which smoothing holds behind each of them."""
        switches = _Switches([lines.first - 1], [self.material], [self.smoothing])
        for k in chosen.tolist():
            word, _, rest = lines.line(k).partition(b" ")
            if word == b"usemtl":
                name = as_text(rest)
                self.material = self.names.setdefault("" if name in ("(null)", "off") else name, len(self.names))
            elif word == b"s":
                self.smoothing = _smoothing_group(rest)
            elif word == b"mtllib":
                self.libraries.append(as_text(rest))
                continue
            else:
                if word not in WITHOUT_EFFECT and len(self.others) < MOST_NAMED:
                    self.others[NOT_SHOWN.get(word, f"lines that begin with '{as_text(word)[:20]}'")] = None
                continue
            switches.add(lines.first + k, self.material, self.smoothing)
        return switches

    def table_bytes(self) -> int:
        """Bytes of the tables so far."""
        return sum(part.nbytes for parts in self.tables.values() for part in parts)

    def joined(self) -> ObjTables:
        """All that was read."""
        tables: dict[str, Any] = {}
        for name, empty in _TABLES.items():
            parts = self.tables.pop(name)
            tables[name] = np.concatenate(parts) if parts else empty
        colors: np.ndarray | None = tables.pop("colors")
        others: dict[str, Any] = {"material_names": list(self.names), "libraries": self.libraries}
        return ObjTables(**tables, colors=colors if self.has_colors else None, not_shown=list(self.others), **others)


@dataclass(eq=False)
class _Switches:
    """What holds from which line on, in a block."""

    lines: list[int]
    materials: list[int]
    smoothing: list[int]

    def add(self, line: int, material: int, smoothing: int) -> None:
        self.lines.append(line)
        self.materials.append(material)
        self.smoothing.append(smoothing)

    def materials_at(self, lines: np.ndarray) -> np.ndarray:
        return np.array(self.materials, np.int32)[np.searchsorted(self.lines, lines, side="right") - 1]

    def smoothing_at(self, lines: np.ndarray) -> np.ndarray:
        return np.array(self.smoothing, np.int32)[np.searchsorted(self.lines, lines, side="right") - 1]


def read_tables(data: bytes) -> ObjTables:
    """The tables of an OBJ file.

    Raises:
        InputError: a line holds what it should not, of which the message gives the number; or it takes more memory than
            is allowed.
    """
    reader, line = _Reader(), 1
    longest, taken = 0, 0
    data = without_mark(data)
    for block in _blocks(data):
        # Blocks are read one after another: the longest counts.
        budget.take(BYTES_PER_TEXT_BYTE * max(len(block) - longest, 0), "a block of lines")
        longest = max(longest, len(block))
        line = reader.read(block, line)
        # All tables are put together at last, and then there are two of them.
        budget.take(2.0 * (reader.table_bytes() - taken), "its tables")
        taken = reader.table_bytes()
    if b"#MRGB" in data:
        reader.others["ZBrush's colours (#MRGB)"] = None
    return reader.joined()


def _blocks(data: bytes) -> Iterator[bytes]:
    """Runs of whole lines, each ended, lines that go on below a backslash kept together."""
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    begin = 0
    while begin < len(data):
        end = begin + BLOCK
        while True:
            end = data.find(b"\n", end) + 1 or len(data)
            if end - begin > BLOCK + LONGEST_LINE:
                raise InputError(f"a line has more than {LONGEST_LINE >> 20} MiB")
            if end == len(data) or not data[end - 3 : end].replace(b"\r", b"").endswith(b"\\\n"):
                break
        block = data[begin:end]
        yield block if block.endswith(b"\n") else block + b"\n"
        begin = end


def _plain(block: bytes) -> bytes:
    """Lines without comments, indents and continuations; their number stays as it is."""
    if b"\r" in block:
        block = block.replace(b"\r\n", b"\n")
    block = block.translate(BLANKS)
    if b"\\\n" in block:
        block = CONTINUED.sub(_one_line, block)
    if b"#" in block:
        block = COMMENT.sub(b"", block)
    if b"\n " in block or block.startswith(b" "):
        block = INDENT.sub(b"", block)
    return block


def _one_line(match: re.Match[bytes]) -> bytes:
    """Continued lines as one, and as many empty ones below it as there were more."""
    return match[0].replace(b"\\\n", b" ") + b"\n" * match[0].count(b"\\\n")


def _columns(values: np.ndarray, words: np.ndarray, width: int, otherwise: float) -> np.ndarray:
    """(rows, width): the first words of rows, whose words stand one after another; ``otherwise`` where one has less."""
    if len(words) and (words == words[0]).all() and words[0] >= width:
        return np.ascontiguousarray(values.reshape(len(words), -1)[:, :width])
    result = np.full((len(words), width), otherwise)
    starts = np.cumsum(words) - words
    for k in range(width):
        has = words > k
        result[has, k] = values[starts[has] + k]
    return result


def _smoothing_group(rest: bytes) -> int:
    """0 for 'off'."""
    word = rest.strip()
    return int(word[:9]) if word.isdigit() else 0


def as_text(name: bytes) -> str:
    """A name in UTF-8, or else Latin-1."""
    try:
        return name.decode().strip()
    except UnicodeDecodeError:
        return name.decode("latin-1").strip()
