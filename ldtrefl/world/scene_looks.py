"""The looks of a scene's objects, numbered. Scenes that come from one another share them: none is ever removed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from ldtrefl.scene.material import Material
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.look_records import LookRecord, Looks


class SceneLooks:
    """The looks of objects by mesh and material."""

    def __init__(self, decoded: wp.array, device: wp.Device) -> None:
        self.device = device
        self._numbers: dict[tuple[DeviceMesh, object], int] = {}
        self._records: list[LookRecord] = []
        self._struct = Looks()
        self._struct.records = wp.empty(0, dtype=LookRecord, device=device)
        self._struct.decoded = decoded

    def numbers_of(
        self, materials: Sequence[Material], meshes: Sequence[DeviceMesh], mesh_of: np.ndarray
    ) -> np.ndarray:
        """(n,) the number of each object's look, which is added if it is new; -1 for objects that need none.

        Args:
            materials: what the scene says of each object.
            meshes: some meshes.
            mesh_of: (n,) the number of each object's mesh.
        """
        numbers = np.full(len(materials), -1, np.int64)
        of_mesh = np.array([mesh.needs_look for mesh in meshes], bool)
        needs = of_mesh[mesh_of]
        for index in np.flatnonzero(needs).tolist():
            numbers[index] = self._number_of(meshes[mesh_of[index]], materials[index])
        return numbers

    def _number_of(self, mesh: DeviceMesh, material: Material) -> int:
        key = (mesh, material.key)
        if key not in self._numbers:
            self._records.append(mesh.look(material))
            self._numbers[key] = len(self._records) - 1
        return self._numbers[key]

    @property
    def struct(self) -> Looks:
        """All looks as kernels read them. An earlier answer stays as it was."""
        if self._struct.records.shape[0] != len(self._records):
            made = Looks()
            made.records = wp.array(self._records, dtype=LookRecord, device=self.device)
            made.decoded = self._struct.decoded
            self._struct = made
        return self._struct
