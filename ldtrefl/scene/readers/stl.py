"""STL files (3D Systems' "StereoLithography Interface Specification"), binary or as text -> a piece.

A file is a list of facets, three corners each. Their normals follow from the corners: stored ones are often 0 or wrong,
and say no more. Several solids in a text are one mesh.
"""

from __future__ import annotations

import re

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.piece import Piece
from ldtrefl.scene.readers.byte_order_marks import without_mark
from ldtrefl.scene.readers.text_numbers import Lines

HEADER = 84
"""Bytes of a binary file before its facets: 80 of any kind, and how many facets there are."""

FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])
"""A facet of a binary file: its last two bytes are a colour, if any program says so."""

BYTES_PER_BINARY_BYTE = 4.0
"""What a byte of a binary file takes; measured."""

BYTES_PER_TEXT_BYTE = 12.0
"""What a byte of a text takes while its lines are read; measured."""

TEXT = re.compile(rb"\s*solid\b", re.IGNORECASE)
BLANKS = bytes.maketrans(b"\t\v\f\0", b"    ")
INDENT = re.compile(rb"^ +", re.MULTILINE)

KEYWORD = "vertex"
KNOWN = b"sfove\n"
"""How lines begin whose meaning is known: solid, facet, outer loop, vertex and the ends of these; and empty ones."""


def pieces_of_stl(data: bytes) -> tuple[list[Piece], list[str]]:
    """The piece of an STL file, and what it holds that it does not show, a line each.

    Raises:
        InputError: it is damaged, or has no facets.
    """
    with budget.given_back():
        text = b"" if _is_whole_binary(data) else without_mark(data)
        corners, notes = _of_text(text) if TEXT.match(text) else _of_binary(data)
    if not len(corners):
        raise InputError("the mesh has no triangles: it holds no facet")
    # A facet is all that such a file knows: normals of 0 stand for its own.
    faces = np.arange(len(corners)).reshape(-1, 3)
    return [Piece(corners, faces, np.zeros(corners.shape), None)], notes


def _is_whole_binary(data: bytes) -> bool:
    """Whether a file is a binary one by its length, since those may begin with 'solid', too."""
    count = int.from_bytes(data[80:HEADER], "little")
    return len(data) >= HEADER and len(data) == HEADER + FACET.itemsize * count


def _of_binary(data: bytes) -> tuple[np.ndarray, list[str]]:
    """((corners, 3) float64, what is not shown) of a binary file."""
    if len(data) < HEADER:
        raise InputError("not an STL file: it should begin with 'solid', or have a header of 84 bytes")
    count, held = int.from_bytes(data[80:HEADER], "little"), (len(data) - HEADER) // FACET.itemsize
    if count > held:
        raise InputError(f"the file ends among its {count} facets, it holds {held}")
    budget.take(BYTES_PER_BINARY_BYTE * len(data), "its facets")
    facets = np.frombuffer(data, FACET, count, HEADER)
    # Magics says in the header that there are colours, VisCAM by the highest bit of each.
    has_colors = count > 0 and (b"COLOR=" in data[:80] or bool((facets["color"] & 0x8000).all()))
    notes = ["colours of facets"] if has_colors else []
    rest = len(data) - HEADER - FACET.itemsize * count
    if count == 0 and rest:
        raise InputError(f"the mesh has no triangles: its header announces no facet, and {rest} bytes follow")
    notes += [f"{rest} bytes behind its {count} facets"] if rest else []
    return facets["corners"].reshape(-1, 3).astype(np.float64), notes


def _of_text(data: bytes) -> tuple[np.ndarray, list[str]]:
    """((corners, 3) float64, what is not shown) of a text."""
    budget.take(BYTES_PER_TEXT_BYTE * len(data), "its lines")
    text = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").translate(BLANKS).lower()
    lines = Lines.of(INDENT.sub(b"", text) + b"\n", 1)
    first, last = lines.letters(0), lines.letters(len(KEYWORD) - 1)
    is_corner = (first == ord("v")) & (last == ord("x"))
    values, words = lines.rows(is_corner, len(KEYWORD), least=3)
    if (words != 3).any():
        wrong = int(np.flatnonzero(is_corner)[np.argmax(words != 3)])
        raise InputError(f"line {lines.first + wrong}: a vertex has three numbers")
    starts = np.flatnonzero(first == ord("o"))
    sizes = np.diff(np.searchsorted(np.flatnonzero(is_corner), np.append(starts, len(first))))
    if 3 * len(starts) != int(is_corner.sum()) or (sizes != 3).any():
        wrong = int(starts[np.argmax(sizes != 3)]) if (sizes != 3).any() else int(np.argmax(is_corner))
        raise InputError(f"line {lines.first + wrong}: a facet should have three vertices in its 'outer loop'")
    others = np.flatnonzero(~np.isin(first, np.frombuffer(KNOWN, np.uint8)))
    notes = ["lines that are not of a facet"] if len(others) else []
    return values.reshape(-1, 3), notes
