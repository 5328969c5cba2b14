"""Where all objects of a scene stand, and which mesh each has: found at once, however many there are."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Protocol

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.placement import Matrix, UpAxis, moved_first, placements, wrong_sizes
from ldtrefl.scene.shared_geometries import HasGeometry, SharedGeometries

CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
"""(8, 3): of a box's corners, along each axis 0 for its low and 1 for its high side."""


class _Placed(HasGeometry, Protocol):
    """An object of a scene (``description.py``), with what places it."""

    @property
    def matrix(self) -> Matrix | None: ...

    @property
    def fit(self) -> float | None: ...

    @property
    def scale(self) -> float | tuple[float, float, float]: ...

    @property
    def rotate(self) -> tuple[float, float, float, float]: ...

    @property
    def translate(self) -> tuple[float, float, float]: ...

    @property
    def up_axis(self) -> UpAxis: ...

    def world_from_object(self) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class Layout:
    """The meshes and places of n objects."""

    meshes: tuple[Mesh, ...]
    """Each mesh once."""
    mesh_of: np.ndarray
    """(n,) int64: the number of each object's mesh."""
    world_from_object: np.ndarray
    """(n, 4, 4) float64."""

    @classmethod
    def of(cls, objects: Sequence[_Placed]) -> Layout:
        """Lay out objects; those without a mesh are given theirs.

        Raises:
            InputError: a mesh cannot be had, or an object's size along an axis is not allowed.
        """
        shared = SharedGeometries()
        for entry in objects:
            shared.give(entry)
        meshes = [entry.geometry for entry in objects]
        numbers = {mesh: number for number, mesh in enumerate(dict.fromkeys(meshes))}
        mesh_of = np.fromiter(map(numbers.__getitem__, meshes), np.int64, len(meshes))
        fitted = np.array([np.nan if entry.fit is None else entry.fit for entry in objects], float)
        scales = [entry.scale if isinstance(entry.scale, tuple) else (entry.scale,) * 3 for entry in objects]
        turns, positions = [entry.rotate for entry in objects], [entry.translate for entry in objects]
        bounds = np.array([mesh.fit_bounds for mesh in numbers]).reshape(-1, 2, 3)[mesh_of]
        up_axes = [entry.up_axis for entry in objects]
        matrices = placements(bounds, fitted, _rows(scales, 3), _rows(turns, 4), _rows(positions, 3), up_axes)
        own = [number for number, entry in enumerate(objects) if entry.matrix is not None]
        if own:
            matrices[own] = moved_first(matrices[own], np.array([objects[number].matrix for number in own], float))
        for number in wrong_sizes(matrices, bounds):
            try:
                objects[number].world_from_object()
            except InputError as error:
                raise error.within(f"object[{number}]") from None
        return cls(tuple(numbers), mesh_of, matrices)

    def with_objects(self, changed: Mapping[int, tuple[Mesh, np.ndarray]]) -> Layout:
        """The same but for some objects, given the number, the mesh and ``world_from_object`` of each."""
        meshes, mesh_of, matrices = self.meshes, self.mesh_of, self.world_from_object.copy()
        for number, (mesh, world_from_object) in changed.items():
            matrices[number] = world_from_object
            before = mesh_of[number]
            if mesh is not meshes[before] and np.count_nonzero(mesh_of == before) == 1:
                meshes = (*meshes[:before], mesh, *meshes[before + 1 :])  # nothing else has the mesh of before
            elif mesh is not meshes[before]:
                meshes, mesh_of = (*meshes, mesh), mesh_of.copy()
                mesh_of[number] = len(meshes) - 1
        return Layout(meshes, mesh_of, matrices)

    def has_meshes_of(self, other: Layout) -> bool:
        """Whether every object has the mesh that it has in another layout, one of which comes from the other."""
        return self.meshes is other.meshes and self.mesh_of is other.mesh_of

    @functools.cached_property
    def box(self) -> np.ndarray:
        """(2, 3) float64: the lowest and highest corner of the box about all meshes' boxes in the world."""
        if not self.meshes:
            return np.array([[-1.0] * 3, [1.0] * 3])
        corners = np.where(CORNERS == 0, self._bounds[:, :1], self._bounds[:, 1:])
        corners = np.concatenate([corners, np.ones((len(corners), 8, 1))], axis=2)[self.mesh_of]
        placed = corners @ self.world_from_object.transpose(0, 2, 1)
        # Over all objects first: numpy goes through long rows several times as fast.
        return np.stack([placed.min(axis=0).min(axis=0)[:3], placed.max(axis=0).max(axis=0)[:3]])

    @property
    def _bounds(self) -> np.ndarray:
        """(meshes, 2, 3) the lowest and highest corner of each mesh's box."""
        return np.array([mesh.bounds for mesh in self.meshes]).reshape(-1, 2, 3)


def _rows(values: Sequence[Sequence[float]], width: int) -> np.ndarray:
    """(n, width) float64."""
    return np.fromiter(chain.from_iterable(values), float, width * len(values)).reshape(-1, width)
