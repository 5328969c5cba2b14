"""An object placed in device space: its matrices, its bounding sphere, its material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from ldtrefl.scene.description import Object
from ldtrefl.scene.mesh import Mesh
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.records import ObjectRecord

MOST_DOUBLINGS = 120
"""Largest exponent, up or down, of the power of two ``unit_per_device``: float32 reaches from 2^-126 to 2^127."""

SPHERE_PADDING = 2.0e-6
"""Device units by which bounding spheres are widened: ten roundings of a float32 anywhere in the device's box."""

SPHERE_WIDENING = 1.0 + 1e-5
"""Factor by which bounding spheres are widened: what rays are tested with is rounded to float32."""


@dataclass(eq=False)
class DeviceObject:
    """An object of the scene with its float64 matrices."""

    index: int
    source: Object
    geometry: DeviceMesh
    world_from_unit: np.ndarray
    """(4, 4) float64."""
    record: ObjectRecord
    """What kernels read of it."""

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


def world_from_unit(source: Object, mesh: Mesh) -> np.ndarray:
    """(4, 4) float64: the object's place, from the unit space of its mesh."""
    centre, half = mesh.unit_frame
    object_from_unit = np.diag([half, half, half, 1.0])
    object_from_unit[:3, 3] = centre
    return source.world_from_object() @ object_from_unit


def set_geometry(
    record: ObjectRecord, geometry: DeviceMesh, device_from_unit: np.ndarray, first_triangle: int, first_vertex: int
) -> None:
    """Fill in an object's mesh and where it stands.

    Args:
        record: what is filled in.
        geometry: the mesh.
        device_from_unit: (4, 4) float64.
        first_triangle: number of the object's triangle 0 among all objects' triangles.
        first_vertex: number of its vertex 0 among all objects' vertices.
    """
    inverse = np.linalg.inv(device_from_unit)
    record.vertices, record.faces = geometry.vertices, geometry.faces
    record.exact_vertices = geometry.exact_vertices
    record.device_from_unit = wp.mat44d(device_from_unit)
    record.unit_from_device = wp.mat44d(inverse)
    exponent = int(np.clip(np.frexp(np.abs(inverse[:3, :3]).max())[1], -MOST_DOUBLINGS, MOST_DOUBLINGS))
    record.unit_per_device = float(np.ldexp(1.0, exponent))
    record.unit_from_direction = wp.mat33(np.ldexp(inverse[:3, :3], -exponent).astype(np.float32))
    normal_from_unit = inverse[:3, :3].T / np.abs(inverse[:3, :3]).max()
    record.normal_from_unit = wp.mat33(normal_from_unit.astype(np.float32))
    record.centre, record.radius = bounding_sphere(geometry.mesh, device_from_unit)
    record.first_triangle = first_triangle
    record.first_vertex = first_vertex


def set_material(
    record: ObjectRecord, source: Object, geometry: DeviceMesh, decoded: wp.array, *, skip_attributes: bool
) -> None:
    """Fill in an object's material, and the vertex attributes that its shading reads.

    Args:
        record: what is filled in.
        source: the object.
        geometry: its mesh.
        decoded: (256,) float32, the linear value of every byte.
        skip_attributes: leave out normals and texture coordinates that shading does not read.
    """
    material = source.material
    # An object that only glows needs no normals.
    is_lit = max(*material.albedo, *material.mirror) > 0.0
    record.smooth, record.fresnel = int(source.smooth and is_lit), int(material.fresnel)
    needs_normals = record.smooth or not skip_attributes
    record.normals = geometry.normals if needs_normals else geometry.no_normals
    record.albedo, record.emission = wp.vec3(*material.albedo), wp.vec3(*material.emission)
    record.mirror = wp.vec3(*material.mirror)
    record.returns = geometry.mesh.sides_with_returns if source.is_reflector else 0
    look = geometry.appearance(source.texture)
    needs_uvs = look.has_textures or not skip_attributes
    record.uvs = geometry.uvs if needs_uvs else geometry.no_uvs
    record.part_first, record.part_color = look.part_first, look.part_color
    record.part_texture, record.texels, record.texel_bytes = look.part_texture, look.texels, look.texel_bytes
    record.decoded = decoded


def bounding_sphere(mesh: Mesh, device_from_unit: np.ndarray) -> tuple[wp.vec3d, float]:
    """(centre, radius) in device space, about the box's centre, padded for the rounding of what rays are tested with:
    float32 in the device's box."""
    centre = device_from_unit[:3, 3]
    # Not by a matrix product: the threads of BLAS go on spinning for a frame's length and take the cores of ours.
    points = np.einsum("ij,kj->ik", mesh.unit_vertices.astype(float), device_from_unit[:3, :3])
    used = points[mesh.is_used]
    radius = float(np.sqrt((used**2).sum(axis=1).max()))
    return wp.vec3d(*centre), radius * SPHERE_WIDENING + SPHERE_PADDING
