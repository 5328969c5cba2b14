"""The scene on a device, as kernels see it: objects, lights and the camera's ``up``.

``records.py`` says what kernels read and names the three spaces; ``device_space.py`` fixes device space;
``device_mesh.py`` uploads a mesh, which objects share; ``device_object.py`` places an object; ``appearance.py`` and
``lighting.py`` hold colours, textures, lights and the environment. A moved object moves its rays, never its maps.
"""

from __future__ import annotations

import functools

import numpy as np
import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.files.srgb import linear_of_bytes
from ldtrefl.scene.description import Camera, Scene
from ldtrefl.world.camera import unit_up
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_object import DeviceObject, set_geometry, set_material, world_from_unit
from ldtrefl.world.device_space import device_space
from ldtrefl.world.lighting import lighting_of
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.top_level import TopLevel, order_of, top_level

MOST_NUMBERS = (1 << 31) - 1
"""The most triangles, and vertices, that all objects may have together: they are numbered by int32."""


class DeviceScene:
    """A scene on a device.

    Args:
        scene: what is uploaded.
        device: where to.
        before: a scene on the same device from which ``scene`` was made by changing objects
            (:meth:`Scene.with_object`). Meshes, the environment's picture and objects that stand where they stood are
            taken over from it.
        skip_attributes: leave out normals and texture coordinates that shading does not read.

    Raises:
        InputError: a mesh, texture or picture cannot be read, or there are too many triangles, vertices or texels.
    """

    def __init__(
        self, scene: Scene, device: wp.Device, before: DeviceScene | None = None, *, skip_attributes: bool = True
    ) -> None:
        self.scene = scene
        self.device = device
        self._skip_attributes = skip_attributes
        self._top_order: np.ndarray | None = None if before is None else before._top_order
        self._decoded = wp.array(linear_of_bytes(), dtype=float, device=device, copy=False)
        self.device_from_world = device_space(scene.layout_box)
        meshes = self._device_meshes(before)
        self.vertex_count = _counted_vertices(meshes)
        self.objects = self._placed_objects(meshes, before)
        self.records = wp.array([entry.record for entry in self.objects], dtype=ObjectRecord, device=device)
        same_picture = before is not None and before.scene.environment is scene.environment
        lighting_before: LightingRecord | None = before.lighting if before is not None and same_picture else None
        self.lighting: LightingRecord = lighting_of(
            scene, self.device_from_world, self._decoded, device, lighting_before
        )
        self.look_from(scene.camera)

    def _device_meshes(self, before: DeviceScene | None) -> list[DeviceMesh]:
        """Each object's mesh. Equal meshes are one, and those of ``before`` are taken over."""
        known = {} if before is None else {entry.geometry.mesh.key: entry.geometry for entry in before.objects}
        for mesh in (source.geometry for source in self.scene.objects):
            if mesh.key not in known:
                known[mesh.key] = DeviceMesh(mesh, self.device)
        return [known[source.geometry.key] for source in self.scene.objects]

    def _placed_objects(self, meshes: list[DeviceMesh], before: DeviceScene | None) -> list[DeviceObject]:
        """The objects in device space. Those that stand where they stood in ``before`` are taken over: device space is
        the same."""
        former = [] if before is None else before.objects
        placed: list[DeviceObject] = []
        first_triangle = first_vertex = 0
        for index, (source, geometry) in enumerate(zip(self.scene.objects, meshes, strict=True)):
            if former and former[index].source is source:
                placed.append(former[index])
            else:
                record, matrix = ObjectRecord(), world_from_unit(source, geometry.mesh)
                set_geometry(record, geometry, self.device_from_world @ matrix, first_triangle, first_vertex)
                set_material(record, source, geometry, self._decoded, skip_attributes=self._skip_attributes)
                placed.append(DeviceObject(index, source, geometry, matrix, record))
            first_triangle += len(geometry.mesh.faces)
            first_vertex += len(geometry.mesh.vertices)
        return placed

    @functools.cached_property
    def attribute_bytes(self) -> int:
        """Bytes of the normals and texture coordinates on the device."""
        return sum(mesh.attribute_bytes for mesh in {entry.geometry for entry in self.objects})

    @property
    def device_units_per_world_unit(self) -> float:
        """How long a world unit is in device space."""
        return float(self.device_from_world[0, 0])

    @property
    def reflectors(self) -> list[DeviceObject]:
        """The objects that mirror."""
        return [entry for entry in self.objects if entry.source.is_reflector]

    @functools.cached_property
    def reflector_rows(self) -> tuple[wp.array, int]:
        """((objects,) int32, the number of a reflector's triangle 0 among all reflectors' triangles; their count)."""
        counts = [len(entry.geometry.faces) if entry.source.is_reflector else 0 for entry in self.objects]
        firsts = np.cumsum([0, *counts])
        return wp.array(firsts[:-1].astype(np.int32), dtype=wp.int32, device=self.device), int(firsts[-1])

    @functools.cached_property
    def top_level(self) -> TopLevel:
        """The tree over all objects, in the order in which they stood when the scene was laid out."""
        centres = np.array([entry.record.centre for entry in self.objects], np.float64).reshape(-1, 3)
        radii = np.array([entry.record.radius for entry in self.objects], np.float32)
        if self._top_order is None:
            self._top_order = order_of(centres)
        return top_level(centres, radii, self._top_order, self.device)

    def moved_since(self, before: DeviceScene) -> frozenset[int]:
        """Numbers of the objects that have moved since a scene that this one comes from."""
        return frozenset(now.index for now, then in zip(self.objects, before.objects, strict=True) if now is not then)

    def look_from(self, camera: Camera) -> None:
        """Turn the environment to the camera's ``up``. The owner of the scene does so before every frame, and makes one
        frame at a time."""
        self.lighting.up = wp.vec3(*unit_up(camera))


def _counted_vertices(meshes: list[DeviceMesh]) -> int:
    """Vertices of all objects, given the mesh of each.

    Raises:
        InputError: they, or the triangles, are more than can be numbered.
    """
    triangles = vertices = 0
    for entry in meshes:
        triangles += len(entry.mesh.faces)
        vertices += len(entry.mesh.vertices)
        for count, what in ((triangles, "triangles"), (vertices, "vertices")):
            if count > MOST_NUMBERS:
                raise InputError(f"the objects have more than {MOST_NUMBERS} {what}, instances counted in")
    return vertices
