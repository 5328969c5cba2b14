"""OFF files (Geomview's "object file format"), as text -> a piece.

The word at the beginning says what a vertex has besides its position: ``ST`` texture coordinates, ``C`` a colour,
``N`` a normal. Behind the corners of a face a colour of its own may stand. Colours are sRGB, from 0 to 255 or, where
none is above 1, from 0 to 1.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.scene.piece import Piece, unit_vectors
from ldtrefl.scene.readers.byte_order_marks import without_mark
from ldtrefl.scene.readers.corner_tables import (
    check_vertices,
    cut_faces,
    split_corners,
    take_for_triangles,
    with_vertices,
)
from ldtrefl.scene.readers.text_numbers import Lines

WORD = re.compile(rb"(ST)?(C)?(N)?(4)?(n)?OFF\b")
COMMENT = re.compile(rb"#[^\n]*")

BYTES_PER_TEXT_BYTE = 25.0
"""What a byte of a file takes while its lines are read; measured."""

LARGEST_FRACTION = 1.0
"""Colours of which one is above it go from 0 to 255."""


def pieces_of_off(data: bytes) -> tuple[list[Piece], list[str]]:
    """The piece of an OFF file, and what it holds that it does not show, a line each.

    Raises:
        InputError: it is damaged, has no faces, or a face has a vertex that there is not.
    """
    with budget.given_back():
        return _read(data)


def _read(data: bytes) -> tuple[list[Piece], list[str]]:
    budget.take(BYTES_PER_TEXT_BYTE * len(data), "its lines")
    letters, lines = _lines(data)
    counts, words = lines.rows(_some(lines, 0, 1), 0, least=2)
    has_words = int((lines.ends > lines.starts).sum())
    if not (counts[:2] >= 0).all() or 1 + counts[0] + counts[1] > has_words:
        raise InputError(f"the file ends among its {counts[0]:.0f} vertices and {counts[1]:.0f} faces")
    vertex_count, face_count = int(counts[0]), int(counts[1])
    if vertex_count == 0 or face_count == 0:
        raise InputError("the mesh has no triangles: it says that it has no vertices or no faces")
    values, words = lines.rows(_some(lines, 1, vertex_count), 0, least=3)
    if vertex_count and (words != words[0]).any():
        raise InputError("the lines of vertices have different numbers of words")
    vertices = values.reshape(vertex_count, -1)
    points, normals, colors, uvs = _of_vertices(vertices, letters)
    values, words = lines.rows(_some(lines, 1 + vertex_count, face_count), 0, least=1)
    corners, sizes, face_colors, notes = _of_faces(values, words)
    check_vertices(corners, sizes, vertex_count)
    take_for_triangles(sizes)
    cut, of_face = cut_faces(points, corners, sizes)
    if not len(cut):
        raise InputError("the mesh has no triangles")
    piece = Piece(points, corners[cut], normals, uvs, colors=colors)
    if colors is None and face_colors is not None:
        piece = _with_face_colors(piece, np.repeat(face_colors[of_face], 3, axis=0))
    return [piece], notes


def _lines(data: bytes) -> tuple[tuple[bool, ...], Lines]:
    """(what the first word says: ST, C, N, 4, n; the lines behind it)."""
    text = without_mark(data).replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\t", b" ")
    text = COMMENT.sub(b"", text).lstrip(b" \n")
    word = WORD.match(text)
    letters = tuple(bool(group) for group in word.groups()) if word else (False,) * 5
    text = text[word.end() :] if word else text
    if text.lstrip(b" ").startswith(b"BINARY") or letters[4] or letters[3]:
        raise InputError("not a kind of OFF file that can be read (binary, or of more than three dimensions)")
    if re.search(rb"^ +", text, re.MULTILINE):
        text = re.sub(rb"^ +", b"", text, flags=re.MULTILINE)
    return letters, Lines.of(text + b"\n", 1)


def _some(lines: Lines, first: int, count: int) -> np.ndarray:
    """(lines,) bool: some of those that have words."""
    chosen = np.zeros(len(lines.starts), bool)
    chosen[np.flatnonzero(lines.ends > lines.starts)[first : first + count]] = True
    if first == 0 and not chosen.any():
        raise InputError("not an OFF file: it has no line of counts")
    return chosen


def _of_vertices(
    table: np.ndarray, letters: tuple[bool, ...]
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None, np.ndarray | None]:
    """(positions, normals, colours, texture coordinates) of a table of vertices."""
    has_uvs, has_colors, has_normals = letters[:3]
    width = table.shape[1] if len(table) else 3
    at, normals, colors, uvs = 3, None, None, None
    if has_normals and width >= at + 3:
        stored = unit_vectors(table[:, at : at + 3])
        normals, at = (stored if stored.any() else None), at + 3
    rest = width - at - (2 if has_uvs else 0)
    # Programs write colours without saying so, too.
    if rest >= 3 and (has_colors or not has_uvs):
        colors, at = _linear(table[:, at : at + min(rest, 4)]), at + min(rest, 4)
    if has_uvs and width >= at + 2:
        uvs = np.nan_to_num(table[:, at : at + 2]).astype(np.float32)
    return np.ascontiguousarray(table[:, :3]), normals, colors, uvs


def _of_faces(values: np.ndarray, words: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, list[str]]:
    """(corners, how many each face has, (faces, 4) colours, what is not shown)."""
    ends = np.cumsum(words)
    starts = ends - words
    sizes = values[starts]
    is_wrong = ~((sizes >= 0) & (sizes <= words - 1))
    if is_wrong.any():
        raise InputError(f"face {int(np.argmax(is_wrong))} has fewer corners than it says")
    sizes = sizes.astype(np.int64)
    inside = np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    corners = np.nan_to_num(values[np.repeat(starts + 1, sizes) + inside], nan=-1.0).astype(np.int64)
    rest = words - 1 - sizes
    notes = ["numbers of colours in a colour map"] if ((rest > 0) & (rest < 3)).any() else []
    colored = np.flatnonzero(rest >= 3)
    if not len(colored):
        return corners, sizes, None, notes
    first = (starts + 1 + sizes)[colored]
    stored = values[first[:, None] + np.arange(3)]
    has_alpha = bool((rest[colored] >= 4).all())
    if has_alpha:
        stored = np.column_stack([stored, values[first + 3]])
    colors = np.ones((len(words), 4), np.float32)
    colors[colored] = _linear(stored)
    return corners, sizes, colors, notes


def _linear(stored: np.ndarray) -> np.ndarray:
    """(n, 4) float32 linear colours of (n, 3 or 4) sRGB."""
    largest = 255.0 if (stored[:, :3] > LARGEST_FRACTION).any() else 1.0
    colors = np.clip(np.nan_to_num(stored / largest), 0.0, 1.0)
    alpha = colors[:, 3] if colors.shape[1] == 4 else np.ones(len(colors))
    return np.column_stack([linear_from_srgb(colors[:, :3]), alpha]).astype(np.float32)


def _with_face_colors(piece: Piece, colors: np.ndarray) -> Piece:
    """The piece with a colour for each corner: vertices between faces of different colours are doubled."""
    chosen, faces = split_corners(piece.faces, colors)
    doubled = with_vertices(piece, piece.faces.reshape(-1)[chosen], faces)
    return replace(doubled, colors=colors[chosen].astype(np.float32))
