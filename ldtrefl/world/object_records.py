"""The records of objects that kernels read, filled for many objects at once.

What objects share, a mesh's arrays and its colours, is written once and copied. The rest is computed for all objects
together.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from operator import attrgetter

import numpy as np
import warp as wp

from ldtrefl.device.struct_arrays import copy_structs
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.convexity import BACK, FRONT
from ldtrefl.scene.description import Object
from ldtrefl.scene.material import Material, is_given
from ldtrefl.world.device_mesh import DeviceMesh
from ldtrefl.world.records import ObjectRecord
from ldtrefl.world.scene_looks import SceneLooks

MOST_DOUBLINGS = 120
"""Largest exponent, up or down, of the power of two ``unit_per_device``: float32 reaches from 2^-126 to 2^127."""

SMALL = 12
"""Triangles of a box: whether a mesh of so few is flat or convex is found in no time."""


def fill_records(
    records: np.ndarray,
    sources: Sequence[Object],
    meshes: Sequence[DeviceMesh],
    mesh_of: np.ndarray,
    decoded: wp.array,
    looks: SceneLooks,
    *,
    skip_attributes: bool,
) -> None:
    """Fill in all of objects but their places.

    Args:
        records: (n,) what is filled in, as numpy holds an array of ``ObjectRecord``.
        sources: the objects.
        meshes: some meshes.
        mesh_of: (n,) the number of each object's mesh.
        decoded: (256,) float32, the linear value of every byte.
        looks: of the scene, to which those of the objects are added.
        skip_attributes: leave out normals and texture coordinates that shading does not read.
    """
    materials = [source.material for source in sources]
    albedo, mirror, emission = (_colors(materials, name) for name in ("albedo", "mirror", "emission"))
    look_of = looks.numbers_of(sources, meshes, mesh_of)
    albedo[_is_colored_by_file(materials, meshes, mesh_of)] = 1.0
    # An object that only glows needs no normals.
    is_lit = (np.maximum(albedo, mirror).max(axis=1, initial=0.0) > 0.0) | (look_of >= 0)
    smooth = np.array([source.smooth is not False for source in sources], bool) & is_lit
    needs_normals = smooth if skip_attributes else np.ones_like(smooth)
    pictures, picture_of = _pictures(materials)
    # Objects of one kind share all that is not their own.
    shares = (mesh_of * len(pictures) + picture_of) * 4 + 2 * (look_of >= 0) + needs_normals
    kinds, kind_of = np.unique(shares, return_inverse=True)
    shared = []
    for kind in kinds.tolist():
        mesh, picture = divmod(kind // 4, len(pictures))
        uses = {"needs_normals": bool(kind & 1), "has_look": bool(kind & 2), "skip_attributes": skip_attributes}
        shared.append(_shared_record(meshes[mesh], pictures[picture], decoded, **uses))
    copy_structs(wp.array(shared, dtype=ObjectRecord, device="cpu").numpy(), kind_of, records)
    records["look"] = look_of
    records["smooth"], records["fresnel"] = smooth, [material.fresnel for material in materials]
    records["albedo"], records["mirror"], records["emission"] = albedo, mirror, emission
    is_mirror = (mirror.max(axis=1, initial=0.0) > 0.0) & (look_of < 0)
    records["reflects"] = np.where(looks.reflect(look_of), 2, is_mirror)
    records["returns"] = _sides_with_returns(meshes, mesh_of, records["reflects"] > 0)


def fill_places(records: np.ndarray, device_from_unit: np.ndarray, radii: np.ndarray) -> None:
    """Fill in where objects stand.

    Args:
        records: (n,) the records that are filled in.
        device_from_unit: (n, 4, 4) float64.
        radii: (n,) of the bounding spheres, which are about the centres of the meshes' boxes.
    """
    inverse = np.linalg.inv(device_from_unit)
    linear = inverse[:, :3, :3]
    largest = np.abs(linear).max(axis=(1, 2), initial=0.0)
    exponents = np.frexp(largest)[1].clip(-MOST_DOUBLINGS, MOST_DOUBLINGS)
    records["device_from_unit"], records["unit_from_device"] = device_from_unit, inverse
    records["unit_per_device"] = np.ldexp(1.0, exponents)
    records["unit_from_direction"] = np.ldexp(linear, -exponents[:, None, None])
    records["normal_from_unit"] = linear.transpose(0, 2, 1) / largest[:, None, None]
    records["centre"], records["radius"] = device_from_unit[:, :3, 3], radii


def _colors(materials: Sequence[Material], name: str) -> np.ndarray:
    """(n, 3) float64 of the materials' colours of this name."""
    return np.fromiter(chain.from_iterable(map(attrgetter(name), materials)), float, 3 * len(materials)).reshape(-1, 3)


def _is_colored_by_file(materials: Sequence[Material], meshes: Sequence[DeviceMesh], mesh_of: np.ndarray) -> np.ndarray:
    """(n,) whether the mesh's file alone says an object's colour: no albedo is given, nor a mirror, beside which it is
    0."""
    is_colored = np.array([mesh.has_material for mesh in meshes], bool)[mesh_of]
    for index in np.flatnonzero(is_colored).tolist():
        is_colored[index] = not is_given(materials[index].albedo) and not any(materials[index].mirror)
    return is_colored


def _sides_with_returns(meshes: Sequence[DeviceMesh], mesh_of: np.ndarray, is_reflector: np.ndarray) -> np.ndarray:
    """(n,) from which sides rays can come back to each object. Meshes of reflectors are looked at, and small ones:
    those of floors and boxes are not asked for shadows that fall on them."""
    is_looked_at = np.array([len(mesh.faces) <= SMALL for mesh in meshes], bool)
    is_looked_at[mesh_of[is_reflector]] = True
    of_mesh = np.full(len(meshes), FRONT | BACK)
    for number in np.flatnonzero(is_looked_at).tolist():
        of_mesh[number] = meshes[number].mesh.sides_with_returns
    return of_mesh[mesh_of]


def _pictures(materials: Sequence[Material]) -> tuple[list[StoredPicture | None], np.ndarray]:
    """The materials' textures, each once, None the first; (n,) the number of each material's."""
    numbers: dict[str | None, int] = {None: 0}
    pictures: list[StoredPicture | None] = [None]
    picture_of = np.zeros(len(materials), np.int64)
    for index, material in enumerate(materials):
        picture = None if material.texture is None else material.picture
        if picture is not None:
            if picture.key not in numbers:
                numbers[picture.key] = len(pictures)
                pictures.append(picture)
            picture_of[index] = numbers[picture.key]
    return pictures, picture_of


def _shared_record(
    mesh: DeviceMesh,
    texture: StoredPicture | None,
    decoded: wp.array,
    *,
    needs_normals: bool,
    has_look: bool,
    skip_attributes: bool,
) -> ObjectRecord:
    """A record of a mesh's arrays and colours, and of the vertex attributes that shading reads."""
    record, look = ObjectRecord(), mesh.bare_appearance if has_look else mesh.appearance(texture)
    record.vertices, record.faces, record.exact_vertices = mesh.vertices, mesh.faces, mesh.exact_vertices
    record.normals = mesh.normals if needs_normals else mesh.no_normals
    record.uvs = mesh.uvs if look.has_textures or not skip_attributes else mesh.no_uvs
    record.part_first, record.part_color = look.part_first, look.part_color
    record.part_texture, record.texels, record.texel_bytes = look.part_texture, look.texels, look.texel_bytes
    record.part_mips, record.mip_texels, record.mip_bytes = look.part_mips, look.mip_texels, look.mip_bytes
    record.decoded = decoded
    return record
