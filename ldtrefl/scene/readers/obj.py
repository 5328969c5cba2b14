"""OBJ files -> pieces: one of each material, with what each corner of each face has.

Corners that share a position but not their texture coordinates or normals stay apart. Faces without normals are smooth
within their smoothing group, and flat where the file switches smoothing off; a file that says nothing of it is smooth.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.scene.piece import Piece, unit_vectors
from ldtrefl.scene.readers.corner_tables import cut_faces, split_corners, take_for_triangles
from ldtrefl.scene.readers.files_beside import Beside
from ldtrefl.scene.readers.mtl import MaterialLibrary
from ldtrefl.scene.readers.obj_text import ObjTables, read_tables
from ldtrefl.scene.readers.pictures import Pictures, file_beside
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial, Texture

WITH_NORMALS = 1 << 30
"""Stands in the place of a smoothing group for faces with normals of their own."""

LOW = (1 << 32) - 1
"""The part of a key that is a smoothing group; above it stands a material."""

BYTES_PER_COLOR = 100.0
"""What a colour takes while it is decoded; measured."""

BYTES_PER_PIECE = 2000.0
"""What a piece takes besides its vertices and triangles, its material included; measured."""

GREATEST_FRACTION = 1.0
"""Colours above it are taken for 0 to 255."""


def pieces_of_obj(data: bytes, beside: Beside) -> tuple[list[Piece], list[str]]:
    """The pieces of an OBJ file, and what it holds that they do not show, a line each.

    Raises:
        InputError: a line holds what it should not, or a face has a vertex that there is not.
    """
    with budget.given_back():
        tables = read_tables(data)
        notes = list(tables.not_shown)
        _check(tables, notes)
        take_for_triangles(tables.sizes)
        triangles, faces = _triangles(tables, notes)
        pieces = _split(tables, triangles, faces, _colors(tables.colors))
    budget.take(BYTES_PER_PIECE * len(pieces), f"{len(pieces)} materials")
    looks, faults = _materials(tables, beside)
    notes += faults
    return [_with_look(piece, looks[material], notes) for material, piece in pieces], notes


def _check(tables: ObjTables, notes: list[str]) -> None:
    """Numbers of corners that there are not: of positions they are refused, others are noted and left out."""
    if not len(tables.sizes):
        raise InputError("the mesh has no triangles: no line of the file is a face, 'f 1 2 3'")
    for k, of, what in (
        (0, tables.positions, "vertex"),
        (1, tables.uvs, "texture coordinates"),
        (2, tables.normals, "normals"),
    ):
        is_wrong = tables.corners[:, k] >= len(of)
        if not is_wrong.any():
            continue
        if k == 0:
            corner = int(np.argmax(is_wrong))
            face = int(np.searchsorted(np.cumsum(tables.sizes), corner, side="right"))
            raise InputError(
                f"line {tables.lines[face]}: there is no {what} {tables.corners[corner, 0] + 1}, there are {len(of)}"
            )
        notes.append(f"{what} of {int(is_wrong.sum())} corners (the file has only {len(of)})")
        tables.corners[is_wrong, k] = -1
    for name, of in (("texture coordinates", tables.uvs), ("normals", tables.normals)):
        if not np.isfinite(of).all():
            notes.append(f"{name} that are not finite")
            of[~np.isfinite(of).all(axis=1)] = 0.0


def _triangles(tables: ObjTables, notes: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """((m, 3) numbers of corners, (m,) number of the face) of the triangles that faces are cut into."""
    if (tables.sizes < 3).any():
        notes.append(f"{int((tables.sizes < 3).sum())} faces of fewer than three corners")
    cut, of_face = cut_faces(tables.positions, tables.corners[:, 0], tables.sizes)
    if not len(cut):
        raise InputError("the mesh has no triangles: every face has fewer than three corners")
    return cut, of_face


def _split(
    tables: ObjTables, triangles: np.ndarray, faces: np.ndarray, colors: np.ndarray | None
) -> list[tuple[int, Piece]]:
    """(number of its material, piece): triangles of one material, and of one smoothing group if they have no normals,
    in the order of the file."""
    has_normals = (tables.corners[triangles, 2] >= 0).any(axis=1)
    smoothing = np.where(has_normals, WITH_NORMALS, tables.smoothing[faces])
    keys = (tables.materials[faces].astype(np.int64) << 32) + smoothing
    if (keys == keys[0]).all():
        groups, starts = keys[:1], np.array([0, len(keys)])
    else:
        found, first, group = np.unique(keys, return_index=True, return_inverse=True)
        # As they come in the file.
        order = np.argsort(first)
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        group = rank[group]
        triangles = triangles[np.argsort(group, kind="stable")]
        groups, starts = found[order], np.concatenate([[0], np.cumsum(np.bincount(group))])
    of_group = np.repeat(np.arange(len(groups)), np.diff(starts))
    corners, numbers = _different(tables, triangles, of_group)
    pieces = []
    for k, key in enumerate(groups.tolist()):
        run = numbers[starts[k] : starts[k + 1]]
        low = int(run.min()) if len(groups) > 1 else 0
        high = int(run.max()) + 1 if len(groups) > 1 else len(corners)
        pieces.append((key >> 32, _piece(tables, corners[low:high], run - low, key & LOW, colors)))
    return pieces


def _different(tables: ObjTables, triangles: np.ndarray, of_group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners that differ.

    Returns:
        ((n, 3) numbers of position, texture coordinates and normal, group by group; (m, 3) which of them each corner of
        a triangle has).
    """
    corners = tables.corners[triangles.reshape(-1)]
    places = corners[:, 0]
    is_as_stored = len(of_group) == 0 or of_group[-1] == 0
    if is_as_stored and all((column < 0).all() or np.array_equal(column, places) for column in corners.T[1:]):
        every = np.arange(len(tables.positions), dtype=np.int32)
        used = [every if (column >= 0).any() else np.full_like(every, -1) for column in corners.T]
        return np.stack(used, 1), places.reshape(-1, 3).astype(np.int64)
    chosen, numbers = split_corners(
        places.reshape(-1, 3), np.column_stack([corners[:, 1:], np.repeat(of_group.astype(np.int32), 3)])
    )
    return corners[chosen], numbers


def _piece(
    tables: ObjTables, corners: np.ndarray, faces: np.ndarray, smoothing: int, colors: np.ndarray | None
) -> Piece:
    """A piece of corners by their numbers, (n, 3), and (m, 3) faces of them."""
    places, at, sides = corners.T
    normals = uvs = None
    if smoothing == WITH_NORMALS:
        normals = unit_vectors(_taken(tables.normals, sides))
        normals = normals if normals.any() else None
    elif smoothing == 0:
        normals = np.zeros((len(corners), 3))
    if (at >= 0).any():
        uvs = _taken(tables.uvs, at).astype(np.float32)
    return Piece(
        tables.positions if _is_whole(places, tables.positions) else tables.positions[places],
        faces,
        normals,
        uvs,
        colors=None if colors is None else colors[places],
    )


def _is_whole(numbers: np.ndarray, of: np.ndarray) -> bool:
    """Whether all of a table's rows are meant, in their order."""
    return len(numbers) == len(of) and bool((numbers == np.arange(len(of))).all())


def _taken(values: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Rows of a table by their numbers; zeros for -1, and for rows that the table does not have."""
    taken = values[np.clip(numbers, 0, len(values) - 1)]
    taken[(numbers < 0) | (numbers >= len(values))] = 0.0
    return taken


def _colors(stored: np.ndarray | None) -> np.ndarray | None:
    """(n, 4) float32 linear colours and alpha of the positions. The file's are sRGB, as Blender and MeshLab write."""
    if stored is None:
        return None
    budget.take(BYTES_PER_COLOR * len(stored), "its colours")
    colors = np.nan_to_num(stored, nan=1.0, posinf=1.0, neginf=0.0)
    if colors.max() > GREATEST_FRACTION:
        is_white = (colors == 1.0).all(axis=1)
        colors = np.where(is_white[:, None], 1.0, colors / 255.0)
        colors[(stored[:, 3] == 1.0), 3] = 1.0
    colors = np.clip(colors, 0.0, 1.0)
    return np.column_stack([linear_from_srgb(colors[:, :3]), colors[:, 3]]).astype(np.float32)


def _materials(tables: ObjTables, beside: Beside) -> tuple[list[SurfaceMaterial], list[str]]:
    """(the materials by their numbers, what of them is not shown)."""
    pictures = Pictures(beside)
    library = MaterialLibrary(pictures)
    notes = []
    for line in dict.fromkeys(tables.libraries):
        found = _library_files(line, beside)
        for name, data in found.items():
            if data is None:
                notes.append(f"the materials of '{name}' (it is not beside the file)")
            else:
                library.add(data)
    looks = [PLAIN]
    missing = []
    for name in tables.material_names[1:]:
        material = library.material(name)
        if material is None:
            missing.append(name)
            material = replace(PLAIN, name=name)
        looks.append(material)
    if missing and not tables.libraries:
        notes.append(f"materials, as the file names no MTL file: {_listed(missing)}")
    elif missing and not any("is not beside" in note for note in notes):
        notes.append(f"materials that no MTL file has: {_listed(missing)}")
    return looks, notes + library.not_shown + pictures.not_shown


def _listed(names: list[str]) -> str:
    return ", ".join(f"'{name[:40]}'" for name in names[:5]) + (", ..." if len(names) > 5 else "")


def _library_files(line: str, beside: Beside) -> dict[str, bytes | None]:
    """The files that a line names: one, whose name may hold blanks, or several."""
    whole = file_beside(beside, line)
    if whole is not None or len(line.split()) < 2:
        return {line: whole}
    several = {name: file_beside(beside, name) for name in line.split()}
    return several if any(data is not None for data in several.values()) else {line: None}


def _with_look(piece: Piece, look: SurfaceMaterial, notes: list[str]) -> Piece:
    """The piece with its material, less textures if it has no texture coordinates."""
    lost: dict[str, Any] = {name: None for name, value in vars(look).items() if isinstance(value, Texture)}
    if piece.uvs is not None or not lost:
        return replace(piece, material=look)
    note = f"the pictures of material '{look.name[:60]}' (faces have no texture coordinates)"
    if note not in notes:
        notes.append(note)
    return replace(piece, material=replace(look, **lost))
