"""PLY files -> pieces: one, or one for each picture that its faces name.

Names of properties are those that Blender, MeshLab, CloudCompare, Open3D and scanners write. Colours of bytes are sRGB
and those of floats linear. Texture coordinates belong to vertices, or to corners of faces as a list ``texcoord``.
"""

from __future__ import annotations

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
from ldtrefl.scene.readers.files_beside import Beside
from ldtrefl.scene.readers.pictures import Pictures
from ldtrefl.scene.readers.ply_tables import Table, read_header, read_tables
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial, Texture

CORNERS = ("vertex_indices", "vertex_index")
TEXTURE_COORDINATES = (*(("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"), ("tx", "ty")),)
COLORS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
POSITION, NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
CORNER_TEXTURE, TEXTURE_NUMBER = "texcoord", "texnumber"

PICTURE = "TextureFile"
"""A comment that begins so names a picture."""

WITHOUT_EFFECT = {"flags", "scalar_flags", "alpha", "diffuse_alpha"}
"""Properties that say nothing of what is seen, or that are read with others."""


def pieces_of_ply(data: bytes, beside: Beside) -> tuple[list[Piece], list[str]]:
    """The pieces of a PLY file, and what it holds that they do not show, a line each.

    Raises:
        InputError: it is damaged, has no faces, or a face has a vertex that there is not.
    """
    data = without_mark(data)
    header = read_header(data)
    notes: list[str] = []
    looks = _looks(header.comments, Pictures(beside), notes)
    with budget.given_back():
        tables = read_tables(data, header)
        pieces = _pieces_of(tables, looks, notes)
    return pieces, notes


def _pieces_of(tables: dict[str, Table], looks: list[SurfaceMaterial], notes: list[str]) -> list[Piece]:
    """The pieces of a file's tables."""
    vertices = tables.get("vertex")
    if vertices is None or not all(name in vertices.columns for name in POSITION):
        raise InputError("the header has no element 'vertex' with properties x, y and z")
    points = _joined(vertices, POSITION)
    seen: dict[str, set[str]] = {"vertex": {*POSITION}, "face": set()}
    corners, sizes = _faces(tables, seen)
    check_vertices(corners, sizes, len(points))
    take_for_triangles(sizes)
    cut, of_face = cut_faces(points, corners, sizes)
    if not len(cut):
        raise InputError("the mesh has no triangles: it is a cloud of points, or its table of faces is empty")
    piece = Piece(points, corners[cut], None, None)
    piece = _with_vertex_values(piece, vertices, seen["vertex"])
    if (sizes < 3).any():
        notes.append(f"{int((sizes < 3).sum())} faces of fewer than three corners")
    faces = tables.get("face")
    if faces is not None:
        piece = _with_corner_values(piece, faces, cut, of_face, sizes, seen["face"])
    pieces = _by_picture(piece, faces, of_face, looks, seen["face"], notes)
    notes += _not_shown(tables, seen)
    return pieces


def _joined(table: Table, names: tuple[str, ...]) -> np.ndarray:
    """(rows, names) float64."""
    return np.stack([table.columns[name] for name in names], 1).astype(np.float64)


def _faces(tables: dict[str, Table], seen: dict[str, set[str]]) -> tuple[np.ndarray, np.ndarray]:
    """((corners,) int64 numbers of vertices, (faces,) int64 how many each has)."""
    faces = tables.get("face")
    for name in CORNERS:
        if faces is not None and name in faces.lists:
            seen["face"].add(name)
            sizes, corners = faces.lists[name]
            return corners.astype(np.int64), sizes
    strips = tables.get("tristrips")
    if strips is not None:
        for name in CORNERS:
            if name in strips.lists:
                seen["tristrips"] = {name}
                return _of_strips(*strips.lists[name])
    raise InputError("the mesh has no triangles: its header has no element 'face' with a list vertex_indices")


def _of_strips(sizes: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of strips, which end at -1: every second one is wound the other way."""
    ends = np.zeros(len(corners) + 1, bool)
    ends[np.cumsum(sizes)[:-1] if len(sizes) else []] = True
    corners = corners.astype(np.int64)
    starts = np.concatenate([[True], corners[:-1] < 0])[: len(corners)] | ends[:-1]
    # The place of each corner in its own strip.
    place = np.arange(len(corners)) - np.maximum.accumulate(np.where(starts, np.arange(len(corners)), 0))
    last = np.flatnonzero((place >= 2) & (corners >= 0))
    triangles = np.stack([corners[last - 2], corners[last - 1], corners[last]], 1)
    is_odd = place[last] % 2 == 1
    triangles[is_odd] = triangles[is_odd][:, [1, 0, 2]]
    return triangles.reshape(-1), np.full(len(triangles), 3, np.int64)


def _with_vertex_values(piece: Piece, vertices: Table, seen: set[str]) -> Piece:
    """The piece with what its vertices have: normals, colours, texture coordinates."""
    normals = uvs = None
    if all(name in vertices.columns for name in NORMAL):
        seen |= {*NORMAL}
        stored = unit_vectors(_joined(vertices, NORMAL))
        normals = stored if stored.any() else None
    for names in TEXTURE_COORDINATES:
        if all(name in vertices.columns for name in names):
            seen |= {*names}
            uvs = _finite(_joined(vertices, names)).astype(np.float32)
            break
    return replace(piece, normals=normals, uvs=uvs, colors=_colors(vertices, seen))


def _with_corner_values(
    piece: Piece, faces: Table, cut: np.ndarray, of_face: np.ndarray, sizes: np.ndarray, seen: set[str]
) -> Piece:
    """The piece with what its faces and their corners have and its vertices have not: these are doubled."""
    values: dict[str, np.ndarray] = {}
    if CORNER_TEXTURE in faces.lists and np.array_equal(faces.lists[CORNER_TEXTURE][0], 2 * sizes):
        seen.add(CORNER_TEXTURE)
        values["uvs"] = _finite(faces.lists[CORNER_TEXTURE][1].astype(np.float64).reshape(-1, 2))[cut.reshape(-1)]
    colors = _colors(faces, seen) if piece.colors is None else None
    if colors is not None:
        values["colors"] = np.repeat(colors[of_face], 3, axis=0)
    if not values:
        return piece
    chosen, numbers = split_corners(piece.faces, np.column_stack(list(values.values())))
    doubled = with_vertices(piece, piece.faces.reshape(-1)[chosen], numbers)
    given = {name: of[chosen].astype(np.float32) for name, of in values.items()}
    return replace(doubled, uvs=given.get("uvs", doubled.uvs), colors=given.get("colors", doubled.colors))


def _colors(table: Table, seen: set[str]) -> np.ndarray | None:
    """(rows, 4) float32 linear colours and alpha; None if the table has none."""
    for names in COLORS:
        if not all(name in table.columns for name in names):
            continue
        seen |= {*names}
        channels = [_fractions(table, name) for name in names]
        colors = np.stack(channels, 1)
        if table.kind(names[0])[0] in "iu":
            colors = linear_from_srgb(colors)
        opacity = names[0].replace("red", "alpha") if "red" in names[0] else "a"
        alpha = _fractions(table, opacity) if opacity in table.columns else np.ones(len(colors))
        return np.nan_to_num(np.column_stack([colors, np.clip(alpha, 0.0, 1.0)])).astype(np.float32)
    return None


def _fractions(table: Table, name: str) -> np.ndarray:
    """A column as fractions: of whole numbers, of the largest that their type has."""
    values, kind = table.columns[name], table.kind(name)
    if kind[0] in "iu":
        # Programs that write colours as int mean those of a byte.
        largest = {"u1": 255.0, "i1": 127.0, "u2": 65535.0, "i2": 32767.0}.get(kind, 255.0)
        return np.clip(values.astype(np.float64) / largest, 0.0, 1.0)
    return np.maximum(values.astype(np.float64), 0.0)


def _finite(values: np.ndarray) -> np.ndarray:
    values[~np.isfinite(values).all(axis=1)] = 0.0
    return values


def _looks(comments: list[str], pictures: Pictures, notes: list[str]) -> list[SurfaceMaterial]:
    """A material for each picture that comments name."""
    names = [comment[len(PICTURE) :].strip() for comment in comments if comment.startswith(PICTURE)]
    looks = []
    for name in names:
        picture = pictures.get(name)
        looks.append(SurfaceMaterial(name=name, base_texture=None if picture is None else Texture(picture)))
    notes += pictures.not_shown
    return looks


def _by_picture(
    piece: Piece,
    faces: Table | None,
    of_face: np.ndarray,
    looks: list[SurfaceMaterial],
    seen: set[str],
    notes: list[str],
) -> list[Piece]:
    """The piece, or one for each picture of its faces."""
    if not looks:
        return [piece]
    if piece.uvs is None:
        notes.append("pictures (there are no texture coordinates)")
        return [piece]
    if faces is None or TEXTURE_NUMBER not in faces.columns or len(looks) == 1:
        seen |= {TEXTURE_NUMBER} if len(looks) == 1 else set()
        notes += [f"the picture '{look.name}' (no face says that it has it)" for look in looks[1:]]
        return [replace(piece, material=looks[0])]
    seen.add(TEXTURE_NUMBER)
    number = faces.columns[TEXTURE_NUMBER].astype(np.int64)[of_face]
    number[(number < 0) | (number >= len(looks))] = len(looks)
    looks = [*looks, PLAIN]
    return [_part(piece, number == k, looks[k]) for k in np.unique(number).tolist()]


def _part(piece: Piece, chosen: np.ndarray, look: SurfaceMaterial) -> Piece:
    """Some of a piece's faces, with the vertices that they use."""
    used, faces = np.unique(piece.faces[chosen], return_inverse=True)
    return replace(with_vertices(piece, used, faces.reshape(-1, 3)), material=look)


def _not_shown(tables: dict[str, Table], seen: dict[str, set[str]]) -> list[str]:
    """What the tables hold and was not read."""
    lines = []
    for name, table in tables.items():
        if name not in seen or (name == "face" and not seen[name]):
            if table.element.count:
                lines.append(f"the element '{name}'")
            continue
        names = [*table.columns, *table.lists]
        rest = [entry for entry in names if entry not in seen[name] and entry not in WITHOUT_EFFECT]
        if rest and table.element.count:
            lines.append(f"{name} properties: {', '.join(rest[:8])}" + (", ..." if len(rest) > 8 else ""))
    return lines
