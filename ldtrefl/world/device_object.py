"""An object placed in device space, as the host sees it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from ldtrefl.scene.description import Object
from ldtrefl.world.device_mesh import DeviceMesh


@dataclass(frozen=True, eq=False)
class DeviceObject:
    """An object of the scene."""

    index: int
    source: Object
    geometry: DeviceMesh
    world_from_unit: np.ndarray
    """(4, 4) float64."""
    centre: np.ndarray
    """(3,) float64, of the bounding sphere, in device space."""
    radius: float
    """Of that sphere, device units."""

    @property
    def longest_side(self) -> float:
        """Length in the world of the longest side of the object's own bounding box."""
        return 2.0 * float(np.linalg.norm(self.world_from_unit[:3, :3], axis=0).max())


@dataclass(frozen=True, eq=False)
class DeviceObjects(Sequence[DeviceObject]):
    """All objects of a scene. Each is made when it is asked for: there may be very many."""

    sources: tuple[Object, ...]
    meshes: Sequence[DeviceMesh]
    """Each mesh once."""
    mesh_of: np.ndarray
    """(n,) the number of each object's mesh."""
    world_from_unit: np.ndarray
    """(n, 4, 4) float64."""
    spheres: np.ndarray
    """(n, 4) float64: centre and radius of each bounding sphere, in device space."""

    def __len__(self) -> int:
        return len(self.sources)

    @overload
    def __getitem__(self, index: int) -> DeviceObject: ...

    @overload
    def __getitem__(self, index: slice) -> list[DeviceObject]: ...

    def __getitem__(self, index: int | slice) -> DeviceObject | list[DeviceObject]:
        numbers = range(len(self))[index]
        return self._made(numbers) if isinstance(numbers, int) else [self._made(number) for number in numbers]

    def __iter__(self) -> Iterator[DeviceObject]:
        return map(self._made, range(len(self)))

    def _made(self, index: int) -> DeviceObject:
        *centre, radius = self.spheres[index].tolist()
        mesh = self.meshes[self.mesh_of[index]]
        return DeviceObject(index, self.sources[index], mesh, self.world_from_unit[index], np.array(centre), radius)
