"""Triangle meshes: checked, and brought to the unit cube.

Vertices are ``(n, 3)`` float64 in the object's own coordinates, faces ``(m, 3)`` int32 in the order of the file: a
triangle's number means the same to the mesh, the ray caster and the layered depth texture.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ldtrefl.bulk import stray_triangles
from ldtrefl.errors import InputError
from ldtrefl.normals import vertex_normals

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
    """A checked triangle mesh. Its arrays are copies of those given, and read-only: what is made of them is kept.

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
        self.faces = checked.astype(np.int32, copy=False)
        """(m, 3) int32."""
        if normals is not None:
            self.normals = _array(normals, np.float32, 3, "normals")
        self.uvs = None if uvs is None else _array(uvs, np.float32, 2, "uvs")
        """(n, 2) float32 texture coordinates, v = 0 at the bottom row."""
        self.parts = parts
        for name, values in (("normals", None if normals is None else self.normals), ("uvs", self.uvs)):
            if values is not None and len(values) != len(self.vertices):
                raise InputError(f"{len(values)} {name} for {len(self.vertices)} vertices")
        for array in (self.vertices, self.faces, None if normals is None else self.normals, self.uvs):
            if array is not None:
                array.flags.writeable = False

    @functools.cached_property
    def normals(self) -> np.ndarray:
        """(n, 3) float32 shading normals; made from the faces, when they are first asked for, if none were given."""
        return _read_only(vertex_normals(self.vertices, self.faces))

    @functools.cached_property
    def is_used(self) -> np.ndarray:
        """(n,) bool: vertices that a triangle has."""
        used = np.zeros(len(self.vertices), bool)
        used[self.faces] = True
        return _read_only(used)

    @functools.cached_property
    def bounds(self) -> np.ndarray:
        """(2, 3) float64: the lowest and highest corner of the triangles' box (unused vertices left out)."""
        used = self.vertices[self.is_used]
        return _read_only(np.stack([used.min(axis=0), used.max(axis=0)]))

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
        return _read_only(low + (high - low) / 2.0), half if half > 0.0 else 1.0

    @functools.cached_property
    def unit_vertices(self) -> np.ndarray:
        """(n, 3) float32 in the unit frame. The shift is done in float64, so a far-off mesh loses nothing."""
        centre, half = self.unit_frame
        return _read_only(np.clip((self.vertices - centre) / half, -1e30, 1e30).astype(np.float32))


def _read_only(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


def _array(values: Any, dtype: type, width: int, name: str) -> np.ndarray:
    try:
        # A copy, whatever is given: the caller's array stays the caller's.
        array: np.ndarray = np.array(values, dtype, order="C")
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
    return _array(array, np.int32 if _fits_int32(array) else np.int64, 3, "faces")


def _fits_int32(array: np.ndarray) -> bool:
    limits = np.iinfo(np.int32)
    return limits.min <= int(array.min()) and int(array.max()) <= limits.max
