"""Mesh files with polygons -> the same files with triangles.

trimesh's readers cut every polygon from its first corner, give triangles of different polygons in another order than
the file's, and refuse binary PLY files whose polygons differ in size. So a file that has polygons of more than three
corners is written anew in memory, each polygon replaced by its triangles. Files of triangles pass as they are.
"""

from __future__ import annotations

import re

import numpy as np

from ldtrefl.scene.readers.ply_polygons import PlyFile, ply_in_triangles
from ldtrefl.scene.readers.polygons import triangles_of

OBJ_POLYGON = re.compile(rb"^[ \t]*f(?:[ \t]+[^\s#]+){4}|^[ \t]*f[^\n#]*-", re.MULTILINE)
"""A face of four corners, or one with relative numbers."""

BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""With which a text file in UTF-8 may begin: it is no part of the first line."""


def has_polygons(data: bytes, kind: str) -> bool:
    """Whether a mesh file of some kind may hold polygons of more than three corners. Takes little memory."""
    if kind == "obj":
        begin = len(BYTE_ORDER_MARK) if data.startswith(BYTE_ORDER_MARK) else 0
        lines = memoryview(data)[begin:]
        return OBJ_POLYGON.search(lines) is not None or b"\\\n" in data or b"\\\r" in data
    if kind == "ply":
        table = PlyFile.of(data)
        return table is not None and not table.is_of_triangles()
    return kind == "off"


def in_triangles(data: bytes, kind: str) -> bytes:
    """A mesh file of kind 'obj', 'off' or 'ply', with triangles in the place of its polygons.

    Raises:
        InputError: polygons that are not convex have too many corners. Other exceptions: the file is damaged.
    """
    return {"obj": _obj, "off": _off, "ply": ply_in_triangles}[kind](data)


def _obj(data: bytes) -> bytes:
    """An OBJ file in triangles. Relative numbers of vertices become absolute ones, too."""
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
    """An OFF file in triangles."""
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
