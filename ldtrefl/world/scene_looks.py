"""The looks of a scene's objects, numbered. Scenes that come from one another share them: none is ever removed."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

import numpy as np
import warp as wp

from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.description import Object, Reflection
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.look_records import LookRecord, Looks
from ldtrefl.world.looks import Look
from ldtrefl.world.reflectance_table import reflectance_table
from ldtrefl.world.rough_environment import rough_environment


class SceneLooks:
    """The looks of objects by mesh and material."""

    def __init__(self, reflection: Reflection, decoded: wp.array, device: wp.Device) -> None:
        self.device = device
        self._reflection = reflection
        self._decoded = decoded
        self._numbers: dict[tuple[DeviceMesh, object, object], int] = {}
        self._looks: list[Look] = []
        self._struct: tuple[int, StoredPicture | None, Looks] | None = None
        """The number of looks and the environment's picture that it was made for, and what was made."""

    def numbers_of(self, sources: Sequence[Object], meshes: Sequence[DeviceMesh], mesh_of: np.ndarray) -> np.ndarray:
        """(n,) the number of each object's look, which is added if it is new; -1 for objects that need none.

        Args:
            sources: the objects as the scene has them.
            meshes: some meshes.
            mesh_of: (n,) the number of each object's mesh.
        """
        numbers = np.full(len(sources), -1, np.int64)
        needs = np.array([mesh.needs_look for mesh in meshes], bool)[mesh_of]
        needs |= np.fromiter(map(attrgetter("material.has_model"), sources), bool, len(sources))
        needs |= np.fromiter(map(attrgetter("parts"), sources), bool, len(sources))
        may_hide = np.array([mesh.is_single_sided for mesh in meshes], bool)[mesh_of]
        may_hide |= np.fromiter((source.material.double_sided is False for source in sources), bool, len(sources))
        for index in np.flatnonzero(may_hide & ~needs).tolist():
            needs[index] = meshes[mesh_of[index]].hides_backs(sources[index])
        for index in np.flatnonzero(needs).tolist():
            numbers[index] = self._number_of(meshes[mesh_of[index]], sources[index])
        return numbers

    def _number_of(self, mesh: DeviceMesh, source: Object) -> int:
        key = (mesh, source.material.key, tuple((pattern, own.key) for pattern, own in source.parts.items()))
        if key not in self._numbers:
            self._looks.append(mesh.look(source, self._reflection))
            self._numbers[key] = len(self._looks) - 1
        return self._numbers[key]

    def reflect(self, numbers: np.ndarray) -> np.ndarray:
        """(n,) bool: whether rays may be sent from looks of these numbers; False for -1."""
        of_look = np.array([*(look.reflects for look in self._looks), False], bool)
        return of_look[numbers]

    def let_through(self, numbers: np.ndarray) -> np.ndarray:
        """(n,) bool: whether looks of these numbers let light through by their alpha; False for -1."""
        of_look = np.array([*(look.lets_through for look in self._looks), False], bool)
        return of_look[numbers]

    def struct(self, environment: StoredPicture | None) -> Looks:
        """All looks as kernels read them, in an environment. An earlier answer stays as it was."""
        before = self._struct
        if before is not None and before[0] == len(self._looks) and before[1] is environment:
            return before[2]
        made, device = Looks(), self.device
        made.records = wp.empty(0, dtype=LookRecord, device=device)
        shares, rough = np.zeros((0, 3), np.float32), np.zeros((0, 0, 0, 3), np.float32)
        if self._looks:
            made.records = wp.array([look.record for look in self._looks], dtype=LookRecord, device=device)
            shares = reflectance_table()
        if environment is not None and any(look.shines for look in self._looks):
            rough = rough_environment(environment)
        made.shares = wp.array(shares, dtype=wp.vec3, device=device, copy=False)
        made.environment = wp.array(rough, dtype=wp.vec3, device=device, copy=False)
        made.decoded = self._decoded
        made.threshold, made.rough_limit = self._reflection.threshold, self._reflection.rough_limit
        self._struct = len(self._looks), environment, made
        return made
