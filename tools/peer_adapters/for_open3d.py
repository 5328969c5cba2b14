"""Our tracers behind the interface of Open3D's ``RaycastingScene``, in a module that calls itself ``open3d``.

Open3D need not be installed. Queries of closest points and distances are no ray queries: a test that comes to one is
skipped there, and counts as one that does not apply.
"""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import ArrayLike, DTypeLike

from ldtrefl.scene import shapes

from .crossings import Crossings, Target

INVALID_ID = 2**32 - 1
"""Number of the geometry and of the triangle that a miss is given."""

TILTS = ((0.43, 0.61, 0.65), (-0.71, 0.13, 0.69), (0.17, -0.83, 0.52))
"""Directions of the rays whose crossings are counted to tell inside from outside."""


class Tensor(np.ndarray):
    """A NumPy array with the few methods of Open3D's tensors that its tests use."""

    def __new__(cls, values: ArrayLike, dtype: DTypeLike | None = None, device: object = None) -> Tensor:
        """An array of a copy of the values."""
        return np.array(values, dtype).view(cls)

    @staticmethod
    def from_numpy(array: np.ndarray) -> Tensor:
        """The array seen as a tensor."""
        return cast(Tensor, array.view(Tensor))

    def __getitem__(self, key: Any) -> Tensor:
        """A tensor, even of one number."""
        return np.asarray(np.asarray(self)[key]).view(Tensor)

    def to(self, target: str | type) -> Tensor:
        """A copy of another type, or the same tensor where a device is named."""
        return self if isinstance(target, str) else Tensor(self, target)

    def cpu(self) -> Tensor:
        """Itself."""
        return self

    def numpy(self) -> np.ndarray:
        """A plain array."""
        return np.asarray(self)


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> SimpleNamespace:
    made = SimpleNamespace(
        vertex=SimpleNamespace(positions=Tensor(vertices, np.float32)),
        triangle=SimpleNamespace(indices=Tensor(faces, np.int64)),
    )
    made.to = lambda device: made
    return made


class TriangleMesh:
    """The two shapes that the tests create."""

    @staticmethod
    def create_box() -> SimpleNamespace:
        """A cube from 0 to 1."""
        box = shapes.make("box")
        return _mesh((box.vertices + 1.0) / 2.0, box.faces)

    @staticmethod
    def create_sphere(radius: float) -> SimpleNamespace:
        """40 x 20 segments with poles on the z axis."""
        sphere = shapes.make("sphere", {"segments": [40, 20]})
        return _mesh(radius * sphere.vertices, sphere.faces)


class RaycastingScene:
    """The part of Open3D's class that its tests use; subclasses name the tracer.

    Methods bear Open3D's names: ``test_occlusions`` is a query of rays, and no test.
    """

    by = "exact"
    INVALID_ID = INVALID_ID

    def __init__(self, nthreads: int = 0, device: object = None) -> None:
        self._vertices: list[np.ndarray] = []
        self._faces: list[np.ndarray] = []
        self._target: Target | None = None

    def add_triangles(self, mesh_or_vertices: SimpleNamespace | np.ndarray, triangles: ArrayLike | None = None) -> int:
        """Add a mesh, or (n, 3) vertices and (m, 3) triangles; returns the number of the geometry."""
        if isinstance(mesh_or_vertices, SimpleNamespace):
            vertices, triangles = mesh_or_vertices.vertex.positions, mesh_or_vertices.triangle.indices
        else:
            vertices = mesh_or_vertices
        self._vertices.append(np.asarray(vertices, float))
        self._faces.append(np.asarray(triangles, int))
        self._target = None
        return len(self._faces) - 1

    def _built(self) -> Target:
        if self._target is None:
            offsets = np.cumsum([0, *(len(vertices) for vertices in self._vertices)])
            faces = [faces + offset for faces, offset in zip(self._faces, offsets, strict=False)]
            self._target = Target(self.by, np.vstack(self._vertices), np.vstack(faces))
        return self._target

    def _named(self, triangle: np.ndarray) -> tuple[Tensor, Tensor]:
        """Geometries and their triangles, of numbers in the joined mesh."""
        firsts = np.cumsum([0, *(len(faces) for faces in self._faces)])
        geometry = np.searchsorted(firsts, triangle, side="right") - 1
        missed = triangle < 0
        numbers = (np.where(missed, INVALID_ID, geometry), np.where(missed, INVALID_ID, triangle - firsts[geometry]))
        return Tensor(numbers[0], np.uint32), Tensor(numbers[1], np.uint32)

    def cast_rays(self, rays: np.ndarray, nthreads: int = 0) -> dict[str, Tensor]:
        """First hits of (..., 6) rays."""
        shape = rays.shape[:-1]
        hits = self._built().first(*_split(rays))
        geometry, triangle = self._named(hits.triangle)
        found = {"t_hit": hits.t, "geometry_ids": geometry, "primitive_ids": triangle}
        found |= {"primitive_uvs": hits.barycentrics, "primitive_normals": hits.normal}
        return {name: Tensor(np.reshape(array, shape + array.shape[1:])) for name, array in found.items()}

    def test_occlusions(self, rays: np.ndarray, tnear: float = 0.0, tfar: float = np.inf, nthreads: int = 0) -> Tensor:
        """(...) bool: whether something is met from ``tnear`` to ``tfar``."""
        origins, directions = _split(rays)
        blocked = self._built().occluded(origins + tnear * directions, directions, tfar - tnear)
        return Tensor(blocked.reshape(rays.shape[:-1]))

    def count_intersections(self, rays: np.ndarray, nthreads: int = 0) -> Tensor:
        """(...) crossings of each ray."""
        found = self._built().crossings(*_split(rays))
        return Tensor(np.bincount(found.ray, minlength=rays.size // 6).reshape(rays.shape[:-1]))

    def list_intersections(self, rays: np.ndarray, nthreads: int = 0) -> dict[str, Tensor]:
        """Every crossing, and where those of each ray begin."""
        found: Crossings = self._built().crossings(*_split(rays))
        geometry, triangle = self._named(found.triangle)
        splits = np.concatenate([[0], np.cumsum(np.bincount(found.ray, minlength=rays.size // 6))])
        arrays = {"ray_splits": splits, "ray_ids": found.ray, "t_hit": found.t.astype(np.float32)}
        arrays |= {"geometry_ids": geometry, "primitive_ids": triangle, "primitive_uvs": found.barycentrics}
        return {name: Tensor(array) for name, array in arrays.items()}

    def compute_occupancy(self, points: np.ndarray, nthreads: int = 0, nsamples: int = 1) -> Tensor:
        """(...) 1 inside and 0 outside (..., 3): most of ``nsamples`` rays cross the surface an odd number of times."""
        votes = np.zeros(points.shape[:-1])
        for tilt in TILTS[:nsamples]:
            rays = np.concatenate([np.asarray(points), np.broadcast_to(tilt, points.shape)], axis=-1)
            votes += np.asarray(self.count_intersections(rays)) % 2
        return Tensor(votes > nsamples / 2, np.float32)

    def compute_closest_points(self, *arguments: object, **options: object) -> None:
        """Skips the test: this is no ray query."""
        pytest.skip("a query of the closest point is no ray query")

    compute_distance = compute_signed_distance = compute_closest_points


def _split(rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    flat = np.asarray(rays, float).reshape(-1, 6)
    return flat[:, :3], flat[:, 3:]


def install(by: str) -> None:
    """A module ``open3d`` whose scenes are traced by a tracer of ours."""
    scene = type("RaycastingScene", (RaycastingScene,), {"by": by})
    module: Any = ModuleType("open3d")
    nothing = SimpleNamespace(device_count=lambda: 0, get_available_devices=list)
    module.core = SimpleNamespace(
        Tensor=Tensor, Device=str, Dtype=SimpleNamespace(UInt32=np.uint32), cuda=nothing, sycl=nothing
    )
    module.core.float32, module.core.uint32 = np.float32, np.uint32
    module.t = SimpleNamespace(geometry=SimpleNamespace(RaycastingScene=scene, TriangleMesh=TriangleMesh))
    sys.modules["open3d"] = module
