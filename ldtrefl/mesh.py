"""Triangle meshes: checked, read from files, brought to the unit cube.

Vertices are ``(n, 3)`` float64 in the object's own coordinates, faces ``(m, 3)`` int32 in the order of the file: a
triangle's number means the same to the mesh, the ray caster and the layered depth texture.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from ldtrefl.bulk import stray_triangles
from ldtrefl.errors import InputError
from ldtrefl.pillow_limit import no_pixel_limit
from ldtrefl.pillow_pictures import picture_of, stored_from_pillow, take_pictures

MAX_TRIANGLES = 1 << 30
"""Triangle numbers are int32 and a fragment keeps one bit of it for the facing."""


LARGEST_COORDINATE = 1e100
"""Sizes and their squares stay finite in float64."""


@dataclass(frozen=True, eq=False)
class Part:
    """A run of triangles with one look: a material of the mesh's file."""

    first_triangle: int = 0
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Linear base colour, times the scene's albedo."""
    texture: np.ndarray | None = None
    """``(h, w, 3)`` uint8, sRGB, or float32, linear, row 0 at v = 1; None without one. It is not to be changed."""


class Mesh:
    """A checked triangle mesh; not to be changed once made.

    Raises:
        InputError: no triangles, an index out of range, a vertex that is not finite, or shapes that do not fit.
    """

    def __init__(
        self,
        vertices: Any,
        faces: Any,
        normals: Any = None,
        uvs: Any = None,
        parts: tuple[Part, ...] = (Part(),),
    ) -> None:
        self.vertices = _array(vertices, np.float64, 3, "vertices")
        """(n, 3) float64."""
        checked = _indices(faces)
        if len(checked) == 0:
            raise InputError("the mesh has no triangles")
        if len(checked) > MAX_TRIANGLES:
            raise InputError(f"the mesh has {len(checked)} triangles, at most {MAX_TRIANGLES} allowed")
        wrong = np.flatnonzero(((checked < 0) | (checked >= len(self.vertices))).any(axis=1))
        if len(wrong):
            first = int(wrong[0])
            raise InputError(
                f"triangle {first} has vertices {checked[first].tolist()}, allowed are 0 to {len(self.vertices) - 1}"
            )
        wrong = np.flatnonzero(~(np.abs(self.vertices) <= LARGEST_COORDINATE).all(axis=1))
        if len(wrong):
            first = int(wrong[0])
            raise InputError(f"vertex {first} is not finite or too large: {self.vertices[first].tolist()}")
        self.faces = checked.astype(np.int32)
        """(m, 3) int32."""
        if normals is not None:
            self.normals = _array(normals, np.float32, 3, "normals")
        self.uvs = None if uvs is None else _array(uvs, np.float32, 2, "uvs")
        """(n, 2) float32 texture coordinates, v = 0 at the bottom row."""
        self.parts = parts
        for name, values in (("normals", None if normals is None else self.normals), ("uvs", self.uvs)):
            if values is not None and len(values) != len(self.vertices):
                raise InputError(f"{len(values)} {name} for {len(self.vertices)} vertices")

    @functools.cached_property
    def normals(self) -> np.ndarray:
        """(n, 3) float32 shading normals; made from the faces, when they are first asked for, if none were given."""
        return smooth_normals(self.vertices, self.faces)

    @functools.cached_property
    def is_used(self) -> np.ndarray:
        """(n,) bool: vertices that a triangle has."""
        used = np.zeros(len(self.vertices), bool)
        used[self.faces] = True
        return used

    @functools.cached_property
    def bounds(self) -> np.ndarray:
        """(2, 3) float64: the lowest and highest corner of the triangles' box (unused vertices left out)."""
        used = self.vertices[self.is_used]
        return np.stack([used.min(axis=0), used.max(axis=0)])

    @functools.cached_property
    def strays(self) -> np.ndarray:
        """(k,) int32: the few triangles far outside the bulk, most often none."""
        return stray_triangles(self.vertices, self.faces, self.bounds)

    @functools.cached_property
    def bulk(self) -> np.ndarray:
        """(2, 3) float64: the lowest and highest corner of the box about all triangles but the strays."""
        if len(self.strays) == 0:
            return self.bounds
        corners = self.vertices[np.delete(self.faces, self.strays, axis=0)].reshape(-1, 3)
        return np.stack([corners.min(axis=0), corners.max(axis=0)])

    @functools.cached_property
    def unit_frame(self) -> tuple[np.ndarray, float]:
        """``(centre, half)``: ``(v - centre) / half`` fills -1..1 along the longest side of the bulk's box."""
        low, high = self.bulk
        half = float((high - low).max()) / 2.0
        return low + (high - low) / 2.0, half if half > 0.0 else 1.0

    @functools.cached_property
    def unit_vertices(self) -> np.ndarray:
        """(n, 3) float32 in the unit frame. The shift is done in float64, so a far-off mesh loses nothing."""
        centre, half = self.unit_frame
        return np.clip((self.vertices - centre) / half, -1e30, 1e30).astype(np.float32)


def _array(values: Any, dtype: type, width: int, name: str) -> np.ndarray:
    try:
        array: np.ndarray = np.ascontiguousarray(values, dtype)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers of shape (n, {width}), got {type(values).__name__}") from error
    if array.ndim != 2 or array.shape[1] != width:
        raise InputError(f"{name} must have shape (n, {width}), got {array.shape}")
    return array


def _indices(values: Any) -> np.ndarray:
    try:
        array = np.asarray(values)
        if array.size == 0:
            return np.zeros((0, 3), np.int64)
        if array.dtype.kind not in "iu":
            whole = array.astype(np.int64)
            if not np.array_equal(whole, array):
                raise ValueError
            array = whole
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError("faces must be whole numbers of shape (m, 3)") from error
    return _array(array, np.int64, 3, "faces")


def smooth_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(n, 3) float32 vertex normals weighted by angle, the same at vertices of one position. Zero where undefined."""
    _, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    inverse = inverse.reshape(-1)
    centre, size = vertices.mean(axis=0), float(np.ptp(vertices, axis=0).max()) or 1.0
    welded = trimesh.Trimesh((vertices[first] - centre) / size, inverse[faces], process=False, validate=False)
    return np.nan_to_num(welded.vertex_normals[inverse]).astype(np.float32)


def load_mesh(path: str | Path) -> Mesh:
    """Read any file that trimesh reads; materials' base colours and textures come along.

    The same file is read once, and again only when it has changed.

    Raises:
        InputError: the file is missing, unreadable or holds no sound mesh; the message names it.
    """
    path = Path(path)
    try:
        stat = path.stat()
    except OSError as error:
        raise InputError(f"{path}: no such mesh ({error.strerror})") from error
    with no_pixel_limit():
        return _load_mesh(str(path.resolve()), stat.st_mtime_ns, stat.st_size)


@functools.lru_cache(maxsize=32)
def _load_mesh(path: str, _modified: int, _size: int) -> Mesh:
    if Path(path).suffix.lower().lstrip(".") not in trimesh.available_formats():
        kinds = ", ".join(sorted(trimesh.available_formats()))
        raise InputError(f"{path}: not a kind of mesh file that can be read (allowed: {kinds})")
    try:
        loaded = trimesh.load_scene(path, process=False, maintain_order=True)
        take_pictures([getattr(geometry.visual, "material", None) for geometry in loaded.geometry.values()])
        pieces = [piece for piece in loaded.dump() if isinstance(piece, trimesh.Trimesh) and len(piece.faces)]
    except InputError as error:
        raise error.within(path) from None
    except Exception as error:  # whatever a damaged file provokes in a reader is the file's fault
        raise InputError(f"{path}: not a mesh that can be read ({type(error).__name__}: {error})") from error
    if not pieces:
        raise InputError(f"{path}: the mesh has no triangles")
    try:
        return _joined(pieces)
    except InputError as error:
        raise error.within(path) from None


def _joined(pieces: list[trimesh.Trimesh]) -> Mesh:
    if len(pieces) == 1:
        uv = _uvs(pieces[0])
        color, texture = _look(pieces[0])
        part = Part(0, color, texture if uv is not None else None)
        return Mesh(pieces[0].vertices, pieces[0].faces, _stored_normals(pieces[0]), uv, (part,))
    with_uvs = any(_uvs(piece) is not None for piece in pieces)
    vertices, faces, normals, uvs, parts = [], [], [], [], []
    vertex_count = triangle_count = 0
    for piece in pieces:
        checked = Mesh(piece.vertices, piece.faces, _stored_normals(piece))
        uv = _uvs(piece)
        vertices.append(checked.vertices)
        faces.append(checked.faces + vertex_count)
        normals.append(checked.normals)
        uvs.append(np.zeros((len(checked.vertices), 2), np.float32) if uv is None else uv)
        color, texture = _look(piece)
        parts.append(Part(triangle_count, color, texture if uv is not None else None))
        vertex_count += len(checked.vertices)
        triangle_count += len(checked.faces)
    return Mesh(
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(normals),
        np.concatenate(uvs) if with_uvs else None,
        tuple(parts),
    )


def _stored_normals(piece: trimesh.Trimesh) -> np.ndarray | None:
    """The normals that the file holds, if it holds any."""
    stored = piece._cache.cache.get("vertex_normals")
    return None if stored is None or np.shape(stored) != np.shape(piece.vertices) else np.asarray(stored)


def _uvs(piece: trimesh.Trimesh) -> np.ndarray | None:
    uv = getattr(piece.visual, "uv", None)
    if uv is None or np.shape(uv) != (len(piece.vertices), 2) or not np.isfinite(uv).all():
        return None
    return np.asarray(uv, np.float32)


def _look(piece: trimesh.Trimesh) -> tuple[tuple[float, float, float], np.ndarray | None]:
    """A piece's base colour, linear, and its texture as it is stored (glTF: factors are linear, textures sRGB)."""
    material = getattr(piece.visual, "material", None)
    if material is None:
        return (1.0, 1.0, 1.0), None
    factor = getattr(material, "baseColorFactor", None)
    color = (1.0, 1.0, 1.0)
    if factor is not None:
        scale = 255.0 if np.asarray(factor).dtype.kind in "iu" else 1.0
        r, g, b = (float(channel) / scale for channel in np.asarray(factor)[:3])
        color = (r, g, b)
    picture = picture_of(material)
    return color, None if picture is None else stored_from_pillow(picture)
