"""Triangle meshes: checked, and brought to the unit cube.

Vertices are ``(n, 3)`` float64 in the object's own coordinates, faces ``(m, 3)`` int32 in the order of the file: a
triangle's number means the same to the mesh, the ray caster and the layered depth texture.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ldtrefl.base.errors import InputError
from ldtrefl.files.content_key import content_key
from ldtrefl.scene.convexity import sides_with_returns
from ldtrefl.scene.mesh_arrays import copied_faces, copied_vertices, fitted_vertices, is_immutable
from ldtrefl.scene.normals import vertex_normals
from ldtrefl.scene.outliers import split_outliers
from ldtrefl.scene.solid import is_solid
from ldtrefl.scene.surface_material import PLAIN, SurfaceMaterial

MAX_TRIANGLES = 1 << 30
"""Triangles are numbered by int32, of which a fragment needs one bit for the way that its triangle faces."""

MOST_VERTICES = (1 << 31) - 1
"""Vertices are numbered by int32."""

KEPT = (
    *("vertices", "faces", "is_used", "bounds", "fit_bounds", "is_deformed"),
    *("uvs", "second_uvs", "colors", "tangents", "parts"),
)
"""What a mesh keeps when it gets other normals."""


@dataclass(frozen=True, eq=False)
class Part:
    """A run of triangles with one material of the mesh's file."""

    first_triangle: int = 0
    material: SurfaceMaterial = PLAIN

    @property
    def key(self) -> str:
        """A hash of all that it holds: parts with the same key are the same."""
        return content_key(str(self.first_triangle), self.material.key)


class Mesh:
    """A checked triangle mesh. Its arrays are read-only, since what is derived from them is stored.

    They are copies of those given. An array is taken without a copy only if it has the right type and is read-only, as
    is all that it is a view of: another mesh's arrays are.

    Raises:
        InputError: no triangles, an index out of range, a vertex that is not finite, or shapes that do not fit.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        normals: ArrayLike | None = None,
        uvs: ArrayLike | None = None,
        parts: tuple[Part, ...] = (Part(),),
        *,
        second_uvs: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
    ) -> None:
        given, corners = _coordinates(vertices), _indices(faces)
        for count, most, what in ((len(corners), MAX_TRIANGLES, "triangles"), (len(given), MOST_VERTICES, "vertices")):
            if count > most:
                raise InputError(f"the mesh has {count} {what}, at most {most} allowed")
        if len(corners) == 0:
            raise InputError("the mesh has no triangles")
        self.faces, self.is_used, wrong = copied_faces(corners, len(given))
        """(m, 3) int32; (n,) bool, whether a triangle has the vertex."""
        if wrong is not None:
            raise InputError(
                f"triangle {wrong} has vertices {corners[wrong].tolist()}, allowed are 0 to {len(given) - 1}"
            )
        self.vertices, self.bounds, wrong = copied_vertices(given, self.is_used)
        """(n, 3) float64; (2, 3) float64, the lowest and highest corner of the box about the triangles. Vertices that
        no triangle has do not count."""
        if wrong is not None:
            raise InputError(f"vertex {wrong} is not finite or too large: {given[wrong].tolist()}")
        self.stored_normals = self._of_vertices(normals, 3, "normals")
        """(n, 3) float32 shading normals, None if none were given."""
        self.uvs = self._of_vertices(uvs, 2, "uvs")
        """(n, 2) float32 texture coordinates, v = 0 at the bottom row; None if none were given."""
        self.second_uvs = self._of_vertices(second_uvs, 2, "second_uvs")
        """(n, 2) float32 other texture coordinates, for textures that ask for them."""
        self.colors = self._of_vertices(colors, 4, "colors")
        """(n, 4) float32 linear colours and alpha, times those of the materials; None if there are none."""
        self.tangents = self._of_vertices(tangents, 4, "tangents")
        """(n, 4) float32 the way of u along the surface, and the sign of the bitangent; None if none were given."""
        self.parts = parts
        self.fit_bounds = self.bounds
        """(2, 3) float64: the box by which an object's ``fit`` places the mesh; that before it was deformed."""
        self.is_deformed = False
        """Whether its vertices have been moved: what is made of it serves for a frame, and is not kept on disk."""
        for array in (self.vertices, self.faces, self.is_used, self.bounds):
            array.flags.writeable = False

    def _of_vertices(self, values: ArrayLike | None, width: int, name: str) -> np.ndarray | None:
        """Checked values of the vertices, (n, width) float32; None if none are given."""
        if values is None:
            return None
        array = _array(values, np.float32, width, name)
        if len(array) != len(self.vertices):
            raise InputError(f"{len(array)} {name} for {len(self.vertices)} vertices")
        return array

    def with_normals(self, normals: ArrayLike) -> Mesh:
        """The same mesh with these shading normals, (n, 3). All its other arrays are shared.

        Raises:
            InputError: there are more or fewer normals than vertices.
        """
        mesh = Mesh.__new__(Mesh)
        vars(mesh).update({name: getattr(self, name) for name in KEPT})
        mesh.stored_normals = mesh._of_vertices(normals, 3, "normals")
        return mesh

    def with_vertices(self, vertices: ArrayLike) -> Mesh:
        """The same mesh, deformed: with these vertices, (n, 3), and normals made from its faces. ``fit`` places it as
        before.

        Raises:
            InputError: there are more or fewer vertices than before, or one is not finite.
        """
        given = _coordinates(vertices)
        if len(given) != len(self.vertices):
            raise InputError(f"{len(given)} vertices in place of {len(self.vertices)}")
        looks = {"second_uvs": self.second_uvs, "colors": self.colors}
        mesh = Mesh(given, self.faces, uvs=self.uvs, parts=self.parts, **looks)
        mesh.fit_bounds, mesh.is_deformed = self.fit_bounds, True
        return mesh

    @functools.cached_property
    def normals(self) -> np.ndarray:
        """(n, 3) float32 shading normals: those given, or else made from the faces when they are first asked for."""
        if self.stored_normals is not None:
            return self.stored_normals
        return _read_only(vertex_normals(self.vertices, self.faces))

    @functools.cached_property
    def surface_key(self) -> str:
        """A hash of the vertices and faces, which are all that rays meet. Made when it is first asked for."""
        return content_key(self.vertices, self.faces)

    @functools.cached_property
    def key(self) -> str:
        """A hash of all that was given: meshes with the same key are the same. Made when it is first asked for."""
        looks = (self.stored_normals, self.uvs, self.second_uvs, self.colors, self.tangents)
        return content_key(self.surface_key, *looks, *(part.key for part in self.parts))

    @functools.cached_property
    def _split(self) -> tuple[np.ndarray, np.ndarray]:
        return split_outliers(self.vertices, self.faces, self.bounds)

    @property
    def outliers(self) -> np.ndarray:
        """(k,) int32: the numbers of the few triangles far outside the bulk, most often none (``outliers.py``)."""
        return self._split[0]

    @property
    def bulk(self) -> np.ndarray:
        """(2, 3) float64: the lowest and highest corner of the box about all triangles but the outliers."""
        return self._split[1]

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
        return _read_only(fitted_vertices(self.vertices, centre, half))

    @functools.cached_property
    def sides_with_returns(self) -> int:
        """From which sides of its triangles rays can come back to it (``convexity.py``); found when first asked for."""
        centre, half = self.unit_frame
        return sides_with_returns((self.vertices - centre) / half, self.faces)

    @functools.cached_property
    def is_solid(self) -> bool:
        """Whether no triangle's back is seen from outside (``solid.py``); found when it is first asked for."""
        return is_solid(self.vertices, self.faces)


def _read_only(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


def _array(values: ArrayLike, dtype: type, width: int, name: str) -> np.ndarray:
    """(n, width) read-only: the values themselves if nobody changes them, or else a copy."""
    if isinstance(values, np.ndarray) and is_immutable(values, dtype):
        return _shaped(np.asarray(values), width, name)
    try:
        array: np.ndarray = np.array(values, dtype, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers of shape (n, {width}), got {type(values).__name__}") from error
    return _read_only(_shaped(array, width, name))


def _shaped(array: np.ndarray, width: int, name: str) -> np.ndarray:
    if array.ndim != 2 or array.shape[1] != width:
        raise InputError(f"{name} must have shape (n, {width}), got {array.shape}")
    return array


def _is_one_of(array: np.ndarray, *dtypes: type) -> bool:
    """Whether kernels can read an array of one of these types where it lies."""
    return array.dtype in dtypes and array.flags.aligned


def _coordinates(values: ArrayLike) -> np.ndarray:
    """(n, 3) float32 or float64, not copied if it is that."""
    if isinstance(values, np.ndarray) and _is_one_of(values, np.float32, np.float64):
        return _shaped(np.asarray(values), 3, "vertices")
    return _array(values, np.float64, 3, "vertices")


def _indices(values: ArrayLike) -> np.ndarray:
    """(m, 3) int32 or int64, not copied if it is that."""
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
    return _shaped(array if _is_one_of(array, np.int32, np.int64) else array.astype(np.int64), 3, "faces")
