"""Pieces of a mesh file -> one mesh, each piece a part of it.

Triangles stand in the order of the file, part by part. Normals that a file stores are used; pieces without any get
smooth ones, each piece by itself: the file says that they are not one surface.
"""

from __future__ import annotations

import numpy as np

from ldtrefl.files.mesh_textures import stored_texture, texture_of
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.mesh import Mesh, Part
from ldtrefl.scene.normals import split_by_side
from ldtrefl.scene.readers.memory import BYTES_PER_TRIANGLE, BYTES_PER_VERTEX
from ldtrefl.scene.readers.pieces import Piece


def joining_bytes(pieces: list[Piece]) -> float:
    """Bytes that :func:`joined_mesh` takes, an estimate."""
    vertices, triangles = (sum(map(len, of)) for of in ([p.vertices for p in pieces], [p.faces for p in pieces]))
    return BYTES_PER_VERTEX * vertices + BYTES_PER_TRIANGLE * triangles


def joined_mesh(pieces: list[Piece]) -> Mesh:
    """One mesh of all pieces, each a part. Smooth normals are made where a piece has none, piece by piece.

    Raises:
        InputError: the pieces are no sound mesh, or a texture is damaged.
    """
    first_vertex = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    first_triangle = np.cumsum([0, *(len(piece.faces) for piece in pieces)]).tolist()
    vertices = np.concatenate([piece.vertices for piece in pieces])
    faces = np.concatenate([piece.faces for piece in pieces])
    if len(pieces) > 1:
        faces = faces + np.repeat(first_vertex[:-1], np.diff(first_triangle))[:, None]
    uvs = _joined_uvs(pieces)
    materials, numbers = distinct_materials(pieces)
    colors_and_textures = [base_color_of(material) for material in materials]
    parts = []
    for first, piece, number in zip(first_triangle[:-1], pieces, numbers, strict=True):
        color, texture = colors_and_textures[number]
        parts.append(Part(first, color, texture if piece.uvs is not None else None))
    mesh = Mesh(vertices, faces, None, uvs, tuple(parts))
    return _with_normals(mesh, pieces, first_vertex, first_triangle)


def _with_normals(mesh: Mesh, pieces: list[Piece], first_vertex: np.ndarray, first_triangle: list[int]) -> Mesh:
    """The mesh with the normals that its pieces store, and smooth ones for those that store none."""
    is_without = np.array([piece.normals is None for piece in pieces])
    stored = [np.zeros(piece.vertices.shape) if piece.normals is None else piece.normals for piece in pieces]
    normals = np.concatenate(stored).astype(np.float32)
    normals.flags.writeable = False  # and so it is not copied
    if not is_without.any():
        return mesh.with_normals(normals)
    number = np.repeat(np.arange(len(pieces)), np.diff(first_vertex))
    triangles = np.flatnonzero(np.repeat(is_without, np.diff(first_triangle)))
    every = len(triangles) == len(mesh.faces)
    sources, split, smooth = split_by_side(
        mesh.vertices, mesh.faces if every else mesh.faces[triangles], number if len(pieces) > 1 else None
    )
    is_smooth = is_without[number[sources]]
    normals = np.where(is_smooth[:, None], smooth, normals[sources])
    normals.flags.writeable = False
    if len(sources) == len(mesh.vertices):
        return mesh.with_normals(normals)
    faces = mesh.faces.copy()
    faces[triangles] = split
    return Mesh(mesh.vertices[sources], faces, normals, None if mesh.uvs is None else mesh.uvs[sources], mesh.parts)


def _joined_uvs(pieces: list[Piece]) -> np.ndarray | None:
    """(n, 2) float32 of all pieces, 0 for those without; None if none has any."""
    found = [piece.uvs for piece in pieces]
    if all(uv is None for uv in found):
        return None
    none = [np.zeros((len(piece.vertices), 2), np.float32) for piece in pieces]
    return np.concatenate([zeros if uv is None else uv for uv, zeros in zip(found, none, strict=True)])


def distinct_materials(pieces: list[Piece]) -> tuple[list[object | None], list[int]]:
    """(trimesh's materials, each once; for each piece the number of its material)."""
    # By identity: trimesh compares materials by hashes of their unpacked pictures.
    numbers: dict[int, int] = {}
    for piece in pieces:
        numbers.setdefault(id(piece.material), len(numbers))
    materials = {id(piece.material): piece.material for piece in pieces}
    return list(materials.values()), [numbers[id(piece.material)] for piece in pieces]


def base_color_of(material: object | None) -> tuple[tuple[float, float, float], StoredPicture | None]:
    """A material's base colour, linear, and its texture. As in glTF factors are linear and textures sRGB."""
    if material is None:
        return (1.0, 1.0, 1.0), None
    factor = getattr(material, "baseColorFactor", None)
    color = (1.0, 1.0, 1.0)
    if factor is not None:
        scale = 255.0 if np.asarray(factor).dtype.kind in "iu" else 1.0
        r, g, b = (float(channel) / scale for channel in np.asarray(factor)[:3])
        color = (r, g, b)
    picture = texture_of(material)
    return color, None if picture is None else stored_texture(picture)
