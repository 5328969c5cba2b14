"""The scene on a device, as kernels see it: objects, lights and the camera's ``up``.

``records.py`` says what kernels read and names the three spaces; ``device_space.py`` fixes device space;
``device_mesh.py`` uploads a mesh, which objects share; ``object_records.py`` fills in what kernels read of objects;
``appearance.py`` and ``lighting.py`` hold colours, textures, lights and the environment. A moved object moves its rays,
never its maps. What is done for each object is done for all at once, in numpy.
"""

from __future__ import annotations

import functools
import itertools
import operator
from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.device.struct_arrays import host_structs
from ldtrefl.files.srgb import linear_of_bytes
from ldtrefl.scene.description import Camera, Scene
from ldtrefl.world.bounding_spheres import bounding_radii
from ldtrefl.world.camera import unit_up
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.device_object import DeviceObject, DeviceObjects
from ldtrefl.world.device_space import device_space
from ldtrefl.world.lighting import lighting_of, stand_up
from ldtrefl.world.look_records import Looks
from ldtrefl.world.object_records import fill_places, fill_records
from ldtrefl.world.records import LightingRecord, ObjectRecord
from ldtrefl.world.scene_looks import SceneLooks
from ldtrefl.world.shading_features import ShadingFeatures
from ldtrefl.world.shaped_lights import has_soft_light
from ldtrefl.world.top_level import TopLevel, order_of, top_level
from ldtrefl.world.triangle_numbers import MOST_NUMBERS, TriangleNumbers, numbered


@dataclass(frozen=True)
class Uploads:
    """What a scene on a device has for shading and for its rays."""

    skip_attributes: bool = True
    """Normals and texture coordinates that shading does not read are left out."""
    probes: int = 0
    """The most probes that a texture is filtered by (``shading/textures.py``); 0: textures are not filtered."""
    needs_footprints: bool = False
    """Rays carry their footprints in any case."""
    samples: int = 1
    """Rays of a pixel, at most."""


USUAL_UPLOADS = Uploads()


class DeviceScene:
    """A scene on a device.

    Args:
        scene: what is uploaded.
        device: where to.
        before: a scene on the same device from which ``scene`` was made by changing objects
            (:meth:`Scene.with_object`). Meshes, the environment's picture and objects that stand where they stood are
            taken over from it.
        uploads: what is uploaded for shading.

    Raises:
        InputError: a mesh, texture or picture cannot be read, or there are too many texels.
    """

    def __init__(
        self, scene: Scene, device: wp.Device, before: DeviceScene | None = None, *, uploads: Uploads = USUAL_UPLOADS
    ) -> None:
        self.scene = scene
        self.device = device
        self._uploads = uploads
        self._top_order: np.ndarray | None = None if before is None else before._top_order
        decoded = wp.array(linear_of_bytes(), dtype=float, device=device, copy=False)
        self._decoded: wp.array = decoded if before is None else before._decoded  # records that are taken over read it
        self._looks: SceneLooks = (
            before._looks if before is not None else SceneLooks(scene.reflection, self._decoded, device)
        )
        self.device_from_world = device_space(scene.layout_box)
        if before is not None and before.scene.layout.has_meshes_of(scene.layout):
            self._take_over(before)
        else:
            self._place_all(before)
        same_picture = before is not None and before.scene.environment is scene.environment
        lighting_before: LightingRecord | None = before.lighting if before is not None and same_picture else None
        self.lighting: LightingRecord = lighting_of(
            scene, self.device_from_world, self._decoded, device, lighting_before
        )
        self.looks: Looks = self._looks.struct(scene.environment_image)
        self.look_from(scene.camera)

    def _place_all(self, before: DeviceScene | None) -> None:
        """Upload the meshes that ``before`` does not have, and place all objects."""
        layout = self.scene.layout
        known = {} if before is None else {mesh.mesh.key: mesh for mesh in before.meshes}
        for mesh in layout.meshes:
            if mesh.key not in known:
                known[mesh.key] = DeviceMesh(mesh, self.device, filters=self._uploads.probes > 0)
        meshes = [known[mesh.key] for mesh in layout.meshes]
        numbers = {mesh: number for number, mesh in enumerate(dict.fromkeys(meshes))}
        self.meshes: list[DeviceMesh] = list(numbers)
        """Each mesh once: those with equal content are one."""
        self.mesh_of: np.ndarray = np.array([numbers[mesh] for mesh in meshes], np.int64)[layout.mesh_of]
        """(objects,) int64, the number of each object's mesh."""
        self.triangle_counts = np.array([len(mesh.faces) for mesh in self.meshes], np.int64)[self.mesh_of]
        """(objects,) int64."""
        self.vertex_counts = np.array([len(mesh.vertices) for mesh in self.meshes], np.int64)[self.mesh_of]
        """(objects,) int64."""
        self.triangle_numbers: TriangleNumbers = numbered(self.triangle_counts, self.device)
        every = np.arange(len(self.mesh_of))
        self.world_from_unit: np.ndarray = np.empty((len(every), 4, 4))
        """(objects, 4, 4) float64."""
        self.spheres: np.ndarray = np.empty((len(every), 4))
        """(objects, 4) float64: centre and radius of each bounding sphere, in device space."""
        self._stamps = np.full(len(every), next(_STAMPS))
        """(objects,) int64: equal in two scenes, one of which comes from the other, if the object has not moved."""
        if before is not None:  # an object was deformed
            stands = ~self._changed_since(before)
            self._stamps[stands] = before._stamps[stands]
        made, self._records = host_structs(len(every), ObjectRecord)
        """(objects,) ``records`` on the host."""
        self._fill(every)
        self._place(every)
        self.records: wp.array = made.to(self.device)

    def _take_over(self, before: DeviceScene) -> None:
        """Take over all objects but those that have changed. Device space and the meshes are the same."""
        self.meshes, self.mesh_of, self.triangle_numbers = before.meshes, before.mesh_of, before.triangle_numbers
        self.triangle_counts, self.vertex_counts = before.triangle_counts, before.vertex_counts
        is_changed, now, then = self._changed_since(before), self.scene.objects, before.scene.objects
        changed = np.flatnonzero(is_changed)
        self.world_from_unit, self.spheres = before.world_from_unit.copy(), before.spheres.copy()
        self._stamps = np.where(is_changed, next(_STAMPS), before._stamps)
        made, self._records = host_structs(len(self.mesh_of), ObjectRecord)
        np.copyto(self._records.view(np.uint8), before._records.view(np.uint8))
        looks = [k for k in changed if now[k].material is not then[k].material or now[k].smooth != then[k].smooth]
        if looks:
            self._fill(np.array(looks))
        self._place(changed)
        self.records = made.to(self.device)

    def _changed_since(self, before: DeviceScene) -> np.ndarray:
        """(objects,) bool: which objects are others than in the scene that this one comes from."""
        now, then = self.scene.objects, before.scene.objects
        return np.fromiter(map(operator.is_not, now, then), bool, len(now))

    def _fill(self, numbers: np.ndarray) -> None:
        """Fill in all but the places of the objects of these numbers."""
        records, sources = self._rows(numbers), [self.scene.objects[number] for number in numbers]
        known = [self.meshes, self.mesh_of[numbers], self._decoded, self._looks]
        fill_records(records, sources, *known, skip_attributes=self._uploads.skip_attributes)
        self._put_back(records, numbers)

    def _rows(self, numbers: np.ndarray) -> np.ndarray:
        """Records to fill in: those of all objects where they are, or copies of some."""
        return self._records if len(numbers) == len(self._records) else self._records[numbers]

    def _put_back(self, records: np.ndarray, numbers: np.ndarray) -> None:
        """Store records that ``_rows`` gave."""
        if records is not self._records:
            self._records[numbers] = records

    def _place(self, numbers: np.ndarray) -> None:
        """Fill in the places of the objects of these numbers."""
        mesh_of, records = self.mesh_of[numbers], self._rows(numbers)
        frames = np.array([_object_from_unit(mesh) for mesh in self.meshes]).reshape(-1, 4, 4)
        world_from_unit = self.scene.layout.world_from_object[numbers] @ frames[mesh_of]
        device_from_unit = self.device_from_world @ world_from_unit
        radii = bounding_radii(self.meshes, mesh_of, device_from_unit)
        fill_places(records, device_from_unit, radii)
        self.world_from_unit[numbers] = world_from_unit
        self.spheres[numbers, :3], self.spheres[numbers, 3] = device_from_unit[:, :3, 3], radii
        self._put_back(records, numbers)

    @functools.cached_property
    def objects(self) -> DeviceObjects:
        """The objects as the host sees them."""
        return DeviceObjects(self.scene.objects, self.meshes, self.mesh_of, self.world_from_unit, self.spheres)

    @functools.cached_property
    def attribute_bytes(self) -> int:
        """Bytes of the normals and texture coordinates on the device."""
        return sum(mesh.attribute_bytes for mesh in self.meshes)

    @property
    def device_units_per_world_unit(self) -> float:
        """How long a world unit is in device space."""
        return float(self.device_from_world[0, 0])

    @functools.cached_property
    def features(self) -> ShadingFeatures:
        """What kernels are built for."""
        probes = self._uploads.probes if any(mesh.has_textures for mesh in self.meshes) else 0
        lighting = self.scene.lighting
        return ShadingFeatures(
            looks=bool((self._records["look"] >= 0).any()),
            dimmed_shadows=lighting.is_traced and bool(self._looks.let_through(self._records["look"]).any()),
            shadows=lighting.shadows,
            soft_light=has_soft_light(self.scene),
            probes=probes,
            footprints=self._uploads.needs_footprints or probes > 0,
        )

    @property
    def samples(self) -> int:
        """Rays of a pixel, at most: their footprints reach less far the more they are."""
        return self._uploads.samples

    @functools.cached_property
    def is_reflector(self) -> np.ndarray:
        """(objects,) bool: from which rays may be sent."""
        return np.asarray(self._records["reflects"] > 0)

    @property
    def reflectors(self) -> list[DeviceObject]:
        """The objects that may send rays."""
        return [self.objects[number] for number in np.flatnonzero(self.is_reflector).tolist()]

    @functools.cached_property
    def reflector_rows(self) -> tuple[wp.array, int]:
        """((objects,) int32, the number of a reflector's triangle 0 among all reflectors' triangles; their count).

        Raises:
            InputError: they are more than can be numbered.
        """
        firsts = np.concatenate([[0], np.cumsum(np.where(self.is_reflector, self.triangle_counts, 0))])
        if firsts[-1] > MOST_NUMBERS:
            raise InputError(f"the mirrors have more than {MOST_NUMBERS} triangles, instances counted in")
        return wp.array(firsts[:-1].astype(np.int32), dtype=wp.int32, device=self.device), int(firsts[-1])

    @functools.cached_property
    def top_level(self) -> TopLevel:
        """The tree over all objects, in the order in which they stood when the scene was laid out."""
        centres, radii = self.spheres[:, :3], self.spheres[:, 3]
        if self._top_order is None:
            self._top_order = order_of(centres)
        return top_level(centres, radii, self._top_order, self.device)

    def moved_since(self, before: DeviceScene) -> frozenset[int]:
        """Numbers of the objects that have moved since a scene that this one comes from."""
        return frozenset(np.flatnonzero(self._stamps != before._stamps).tolist())

    def look_from(self, camera: Camera) -> None:
        """Turn the environment to the camera's ``up``. The owner of the scene does so before every frame, and makes one
        frame at a time."""
        stand_up(self.lighting, self.scene, unit_up(camera), self.device_from_world, self.samples, self.device)


_STAMPS = itertools.count()
"""Numbers for whoever places objects, each used once."""


def _object_from_unit(geometry: DeviceMesh) -> np.ndarray:
    """(4, 4) float64: a mesh's own coordinates from its unit space."""
    centre, half = geometry.mesh.unit_frame
    matrix = np.diag([half, half, half, 1.0])
    matrix[:3, 3] = centre
    return matrix
