"""The scene as kernels see it: geometry, places and materials in device arrays.

Three spaces. *World*: the scene file's. *Device*: the world moved and scaled alike along all axes so that the objects
fill the unit box about 0; all rays and positions in kernels are in it. Positions in it are float64, distances and
directions float32: what is near a surface is as precise as the surface's own object, however large the rest of the
scene is. *Unit*: an object's own vertices with their bounding box's longest side from -1 to 1, where float32 holds at
any scale and offset. Objects with the same mesh share its arrays: a moved object moves its rays, never its maps.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import warp as wp

from ldtrefl.base.errors import InputError
from ldtrefl.device import warp_abi
from ldtrefl.files.pictures import decoded_bytes
from ldtrefl.scene.description import Camera, Light, Object, Scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.world.camera import unit_up
from ldtrefl.world.outliers import outliers_of

MOST_NUMBERS = (1 << 31) - 1
"""Triangles and vertices of all objects together: they are numbered by int32."""

MOST_DOUBLINGS = 120
"""Of a power of two in float32, up or down."""

SPHERE_PADDING = 2.0e-6
"""Device units by which bounding spheres are widened: ten roundings of a float32 anywhere in the device's box."""

CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
"""(8, 3): of a box's corners, along each axis 0 for its low and 1 for its high side."""

BRIGHTEST = 1e30
"""Intensity of a point light in device units: what is brighter is white all the same, and this is finite in float32."""


@wp.struct
class ObjectRecord:
    """An object: its mesh, place and material."""

    vertices: wp.array(dtype=wp.vec3)  # unit space
    exact_vertices: wp.array(dtype=wp.vec3d)  # the same in float64 if some lie far outside the bulk, else empty
    normals: wp.array(dtype=wp.vec3)  # unit space, not always of unit length, zero where undefined
    uvs: wp.array(dtype=wp.vec2)  # empty without texture coordinates
    faces: wp.array(dtype=wp.vec3i)
    device_from_unit: wp.mat44d
    unit_from_device: wp.mat44d
    unit_from_direction: wp.mat33  # the linear part of unit_from_device, over unit_per_device
    unit_per_device: float  # a power of two, so that squares stay in float32's range however small the object is
    normal_from_unit: wp.mat33  # inverse transpose of device_from_unit's linear part
    centre: wp.vec3  # bounding sphere, device space
    radius: float
    first_triangle: int  # number of triangle 0 among all objects' triangles
    first_vertex: int  # and of vertex 0 among all objects' vertices
    triangle_count: int
    smooth: int
    fresnel: int
    albedo: wp.vec3
    emission: wp.vec3
    mirror: wp.vec3
    part_first: wp.array(dtype=wp.int32)  # first triangle of each part
    part_color: wp.array(dtype=wp.vec3)
    part_texture: wp.array(dtype=wp.vec4i)  # first texel, width, height, 1 for bytes; width 0 without a texture
    texels: wp.array(dtype=wp.vec3)  # all parts' textures of floats, row 0 at v = 1
    texel_bytes: wp.array(dtype=wp.vec3ub)  # and those of 8 bits, sRGB
    decoded: wp.array(dtype=float)  # the linear value of every byte


@wp.struct
class LightRecord:
    """A light in device space."""

    is_point: int
    towards: wp.vec3  # of a directional one, unit
    position: wp.vec3d  # of a point light
    radiance: wp.vec3  # point: intensity in device units


@wp.struct
class LightingRecord:
    """Lights and environment."""

    lights: wp.array(dtype=LightRecord)
    ambient: wp.vec3
    sky: wp.vec3
    ground: wp.vec3
    up: wp.vec3  # unit
    image_size: wp.vec2i  # rows and columns of the equirectangular picture; 0 without one
    image: wp.array2d(dtype=wp.vec3)  # its pixels if they are floats
    image_bytes: wp.array2d(dtype=wp.vec3ub)  # and if they have 8 bits, sRGB; the other one is empty
    decoded: wp.array(dtype=float)  # the linear value of every byte
    shadows: int


@dataclasses.dataclass(frozen=True, eq=False)
class Look:
    """Colours and textures of a mesh's parts, as in an ``ObjectRecord``."""

    part_first: wp.array
    part_color: wp.array
    part_texture: wp.array
    texels: wp.array
    texel_bytes: wp.array


def _look_of(mesh: Mesh, texture: np.ndarray | None, device: wp.Device) -> Look:
    textures = [part.texture if texture is None else texture for part in mesh.parts]
    pools: dict[type, list[np.ndarray]] = {np.float32: [], np.uint8: []}
    places: dict[int, tuple[int, int, int, int]] = {}
    for picture in textures:
        if picture is not None and id(picture) not in places:
            kind = np.uint8 if picture.dtype == np.uint8 else np.float32
            first = sum(len(pool) for pool in pools[kind])
            places[id(picture)] = (first, picture.shape[1], picture.shape[0], int(kind is np.uint8))
            pools[kind].append(np.ascontiguousarray(picture, kind).reshape(-1, 3))
    if places and mesh.uvs is None:
        raise InputError("material.texture: the object has no texture coordinates (UVs)")
    table = [(0, 0, 0, 0) if picture is None else places[id(picture)] for picture in textures]
    return Look(
        wp.array([p.first_triangle for p in mesh.parts], dtype=wp.int32, device=device),
        wp.array([p.color for p in mesh.parts], dtype=wp.vec3, device=device),
        wp.array(table, dtype=wp.vec4i, device=device),
        _uploaded(pools[np.float32], wp.vec3, device),
        _uploaded(pools[np.uint8], wp.vec3ub, device),
    )


class DeviceMesh:
    """A mesh's arrays on a device; what only shading needs when it is asked for. On the CPU they are the mesh's own,
    which nobody writes."""

    def __init__(self, mesh: Mesh, device: wp.Device) -> None:
        self.mesh = mesh
        self.vertices = wp.array(mesh.unit_vertices, dtype=wp.vec3, device=device, copy=False)
        self.faces = wp.array(mesh.faces, dtype=wp.vec3i, device=device, copy=False)
        self._looks: dict[int, tuple[np.ndarray | None, Look]] = {}
        """By ``id`` of the texture, which is kept beside."""

    @functools.cached_property
    def outliers(self) -> Any:
        """The mesh's ``Outliers``."""
        return outliers_of(self.mesh, self.vertices.device)

    @functools.cached_property
    def exact_vertices(self) -> wp.array:
        """(n,) vec3d in unit space if the mesh has outliers, else empty: float32 then holds for all of it."""
        centre, half = self.mesh.unit_frame
        exact = (self.mesh.vertices - centre) / half if len(self.mesh.outliers) else np.zeros((0, 3))
        return wp.array(exact, dtype=wp.vec3d, device=self.vertices.device, copy=False)

    @functools.cached_property
    def normals(self) -> wp.array:
        """(n,) vec3 shading normals."""
        return wp.array(self.mesh.normals, dtype=wp.vec3, device=self.vertices.device, copy=False)

    @functools.cached_property
    def uvs(self) -> wp.array:
        """(n,) vec2 texture coordinates, none if the mesh has none."""
        uvs = np.zeros((0, 2), np.float32) if self.mesh.uvs is None else self.mesh.uvs
        return wp.array(uvs, dtype=wp.vec2, device=self.vertices.device, copy=False)

    @functools.cached_property
    def no_uvs(self) -> wp.array:
        """None at all."""
        return wp.empty(0, dtype=wp.vec2, device=self.vertices.device)

    def look(self, texture: np.ndarray | None) -> Look:
        """The colours and textures of the mesh's parts; ``texture``, (h, w, 3), stands for all of theirs if given. One
        for all objects that look the same."""
        if id(texture) not in self._looks:
            self._looks[id(texture)] = texture, _look_of(self.mesh, texture, self.vertices.device)
        return self._looks[id(texture)][1]


@dataclasses.dataclass(eq=False)
class DeviceObject:
    """An object of the scene with its float64 matrices."""

    index: int
    source: Object
    geometry: DeviceMesh
    world_from_unit: np.ndarray
    """(4, 4) float64."""
    record: Any
    """The ``ObjectRecord``."""

    @property
    def vertex_count(self) -> int:
        """Vertices of its mesh."""
        return len(self.geometry.mesh.vertices)

    @property
    def triangle_count(self) -> int:
        """Triangles of its mesh."""
        return len(self.geometry.mesh.faces)

    @property
    def longest_side(self) -> float:
        """Length in the world of the longest side of the object's own bounding box."""
        return 2.0 * float(np.linalg.norm(self.world_from_unit[:3, :3], axis=0).max())


class DeviceScene:
    """A scene uploaded to a device; what is the same as ``before`` is taken over.

    Without ``skip_attributes`` normals and texture coordinates are uploaded even where shading does not use them.
    """

    def __init__(
        self, scene: Scene, device: wp.Device, before: DeviceScene | None = None, *, skip_attributes: bool = True
    ) -> None:
        self.scene = scene
        self.device = device
        self._skip_attributes = skip_attributes
        self._decoded = wp.array(decoded_bytes(), dtype=float, device=device, copy=False)
        former = [] if before is None else before.objects
        self._corners: np.ndarray = np.zeros((len(scene.objects), 8, 3)) if before is None else before._corners.copy()
        """(objects, 8, 3) float64, of their boxes in the world."""
        for index, source in enumerate(scene.objects):
            if before is None or former[index].source is not source:
                self._corners[index] = _world_corners(source)
        self.device_from_world = _device_from_world(self._corners)
        same_space = before is not None and np.array_equal(self.device_from_world, before.device_from_world)
        meshes = {id(entry.geometry.mesh): entry.geometry for entry in former}
        self.objects: list[DeviceObject] = []
        first_triangle = first_vertex = 0
        for index, source in enumerate(scene.objects):
            mesh = source.geometry
            if id(mesh) not in meshes:
                meshes[id(mesh)] = DeviceMesh(mesh, device)
            if same_space and former[index].source is source:
                self.objects.append(former[index])
            else:
                self.objects.append(self._placed(index, source, meshes[id(mesh)], first_triangle, first_vertex))
            first_triangle += len(mesh.faces)
            first_vertex += len(mesh.vertices)
            for count, what in ((first_triangle, "triangles"), (first_vertex, "vertices")):
                if count > MOST_NUMBERS:
                    raise InputError(f"the objects have more than {MOST_NUMBERS} {what}, instances counted in")
        self.triangle_count, self.vertex_count = first_triangle, first_vertex
        self.records = wp.array([entry.record for entry in self.objects], dtype=ObjectRecord, device=device)
        self.lighting = self._lighting(before)
        self.look_from(scene.camera)

    @functools.cached_property
    def attribute_bytes(self) -> int:
        """Bytes of the normals and texture coordinates on the device."""
        meshes = {id(entry.geometry): entry.geometry for entry in self.objects}.values()
        made = [array for mesh in meshes for name, array in vars(mesh).items() if name in ("normals", "uvs")]
        return sum(warp_abi.array_bytes(array) for array in made)

    @property
    def device_units_per_world_unit(self) -> float:
        """Scale of device space."""
        return float(self.device_from_world[0, 0])

    @property
    def reflectors(self) -> list[DeviceObject]:
        """The objects that mirror."""
        return [entry for entry in self.objects if entry.source.is_reflector]

    @functools.cached_property
    def reflector_rows(self) -> tuple[wp.array, int]:
        """(objects,) int32, first of a reflector's triangles among those of all reflectors; and how many there are."""
        counts = [len(entry.geometry.faces) if entry.source.is_reflector else 0 for entry in self.objects]
        firsts = np.cumsum([0, *counts])
        return wp.array(firsts[:-1].astype(np.int32), dtype=wp.int32, device=self.device), int(firsts[-1])

    def moved_since(self, before: DeviceScene) -> set[int] | None:
        """Numbers of the objects that have moved since a scene that this one comes from; None if all may look different
        in device space, because it is another one."""
        if not np.array_equal(self.device_from_world, before.device_from_world):
            return None
        return {now.index for now, then in zip(self.objects, before.objects, strict=True) if now is not then}

    def look_from(self, camera: Camera) -> None:
        """Turn the environment to the camera's ``up``. The owner of the scene does so before every frame, and makes one
        frame at a time."""
        self.lighting.up = wp.vec3(*unit_up(camera))

    def _placed(
        self, index: int, source: Object, geometry: DeviceMesh, first_triangle: int, first_vertex: int
    ) -> DeviceObject:
        centre, half = geometry.mesh.unit_frame
        object_from_unit = np.diag([half, half, half, 1.0])
        object_from_unit[:3, 3] = centre
        world_from_unit = source.world_from_object() @ object_from_unit
        device_from_unit = self.device_from_world @ world_from_unit
        inverse = np.linalg.inv(device_from_unit)
        record = ObjectRecord()
        record.vertices, record.faces = geometry.vertices, geometry.faces
        record.exact_vertices = geometry.exact_vertices
        record.device_from_unit = wp.mat44d(device_from_unit)
        record.unit_from_device = wp.mat44d(inverse)
        exponent = int(np.clip(np.frexp(np.abs(inverse[:3, :3]).max())[1], -MOST_DOUBLINGS, MOST_DOUBLINGS))
        record.unit_per_device = float(np.ldexp(1.0, exponent))
        record.unit_from_direction = wp.mat33(np.ldexp(inverse[:3, :3], -exponent).astype(np.float32))
        normal_from_unit = inverse[:3, :3].T / np.abs(inverse[:3, :3]).max()
        record.normal_from_unit = wp.mat33(normal_from_unit.astype(np.float32))
        record.centre, record.radius = _bounding_sphere(geometry.mesh, device_from_unit)
        record.first_triangle, record.triangle_count = first_triangle, len(geometry.mesh.faces)
        record.first_vertex = first_vertex
        material = source.material
        # An object that only glows needs no normals.
        is_lit = max(*material.albedo, *material.mirror) > 0.0
        record.smooth, record.fresnel = int(source.smooth and is_lit), int(material.fresnel)
        needs_normals = record.smooth or not self._skip_attributes
        record.normals = geometry.normals if needs_normals else wp.empty(0, dtype=wp.vec3, device=self.device)
        record.albedo, record.emission = wp.vec3(*material.albedo), wp.vec3(*material.emission)
        record.mirror = wp.vec3(*material.mirror)
        self._look(record, source, geometry)
        return DeviceObject(index, source, geometry, world_from_unit, record)

    def _look(self, record: Any, source: Object, geometry: DeviceMesh) -> None:
        look = geometry.look(source.texture)
        has_textures = look.texels.shape[0] + look.texel_bytes.shape[0] > 0
        needs_uvs = has_textures or not self._skip_attributes
        record.uvs = geometry.uvs if needs_uvs else geometry.no_uvs
        record.part_first, record.part_color = look.part_first, look.part_color
        record.part_texture, record.texels, record.texel_bytes = look.part_texture, look.texels, look.texel_bytes
        record.decoded = self._decoded

    def _lighting(self, before: DeviceScene | None) -> Any:
        scene = self.scene
        record = LightingRecord()
        lights = [self._light(light) for light in scene.lights]
        record.lights = (
            wp.array(lights, dtype=LightRecord, device=self.device)
            if lights
            else wp.empty(0, dtype=LightRecord, device=self.device)
        )
        record.ambient = wp.vec3(*scene.lighting.ambient)
        record.sky, record.ground = wp.vec3(*scene.environment.sky), wp.vec3(*scene.environment.ground)
        if before is not None and before.scene.environment is scene.environment:
            for name in ("image_size", "image", "image_bytes"):
                setattr(record, name, getattr(before.lighting, name))
        else:
            image = scene.environment_image
            record.image_size = wp.vec2i(0, 0) if image is None else wp.vec2i(*image.shape[:2])
            for name, kind, dtype in (("image", np.float32, wp.vec3), ("image_bytes", np.uint8, wp.vec3ub)):
                own = image if image is not None and image.dtype == kind else np.empty((0, 0, 3), kind)
                setattr(record, name, wp.array(own, dtype=dtype, device=self.device, copy=False))
        record.decoded = self._decoded
        record.shadows = int(scene.lighting.shadows)
        return record

    def _light(self, light: Light) -> Any:
        record = LightRecord()
        record.is_point = int(light.kind == "point")
        if light.position is not None and light.intensity is not None:
            record.position = wp.vec3d(*(self.device_from_world @ [*light.position, 1.0])[:3])
            intensity = np.asarray(light.intensity) * self.device_units_per_world_unit**2
            record.radiance = wp.vec3(*np.minimum(intensity, BRIGHTEST))
        elif light.direction is not None and light.radiance is not None:
            towards = -np.asarray(light.direction, float)
            record.towards = wp.vec3(*(towards / np.linalg.norm(towards)))
            record.radiance = wp.vec3(*light.radiance)
        return record


def _uploaded(pools: list[np.ndarray], dtype: Any, device: wp.Device) -> wp.array:
    """(n, 3) arrays, one after the other, on a device. On the CPU a single one is read where it lies: it may be large.

    Raises:
        InputError: they are more than can be numbered.
    """
    total = sum(len(pool) for pool in pools)
    if total > np.iinfo(np.int32).max:
        raise InputError(f"an object's textures have {total} texels, at most {np.iinfo(np.int32).max} allowed")
    if len(pools) == 1:
        return wp.array(pools[0], dtype=dtype, device=device, copy=False)
    joined = wp.empty(total, dtype=dtype, device=device)
    first = 0
    for pool in pools:
        wp.copy(joined, wp.array(pool, dtype=dtype, device=device, copy=False), dest_offset=first)
        first += len(pool)
    return joined


def _device_from_world(corners: np.ndarray) -> np.ndarray:
    """(4, 4) float64 from the corners of the objects' boxes, (objects, 8, 3) in the world."""
    if not len(corners):
        return np.eye(4)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    half = float((high - low).max()) / 2.0
    scale = 1.0 / half if half > 0.0 else 1.0
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = -(low + (high - low) / 2.0) * scale
    return matrix


def _world_corners(entry: Object) -> np.ndarray:
    """(8, 3) float64: the corners of the object's own box, in the world."""
    low, high = entry.geometry.bounds
    corners = np.where(CORNERS == 0, low, high)
    return (np.hstack([corners, np.ones((8, 1))]) @ entry.world_from_object().T)[:, :3]


def _bounding_sphere(mesh: Mesh, device_from_unit: np.ndarray) -> tuple[wp.vec3, float]:
    """About the box's centre, padded for the rounding of what rays are tested with: float32 in the device's box."""
    centre = device_from_unit[:3, 3]
    # Not by a matrix product: the threads of BLAS go on spinning for a frame's length and take the cores of ours.
    points = np.einsum("ij,kj->ik", mesh.unit_vertices.astype(float), device_from_unit[:3, :3])
    used = points[mesh.is_used]
    radius = float(np.sqrt((used**2).sum(axis=1).max()))
    return wp.vec3(*centre), radius * (1.0 + 1e-5) + SPHERE_PADDING
