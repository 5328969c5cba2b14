"""Primitives of meshes (glTF 2.0, 3.7.2): triangles and what their vertices have, morphed to their weights at rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.accessors import elements, fractions, values
from ldtrefl.scene.gltf.container import Document, Table
from ldtrefl.scene.gltf.draco import draco_attributes

TRIANGLES, STRIP, FAN = 4, 5, 6
WITHOUT_SURFACE = {0: "points", 1: "lines", 2: "lines", 3: "lines"}
"""Modes of primitives that have no surface, and what they are."""

UV_SETS = 2
"""Sets of texture coordinates that are kept."""

MOST_TARGETS = 1 << 12
"""Morph targets of a primitive, at most."""


@dataclass(frozen=True, eq=False)
class Primitive:
    """Triangles of one material."""

    vertices: np.ndarray
    """(n, 3) float64."""
    faces: np.ndarray
    """(m, 3) int64."""
    normals: np.ndarray | None
    """(n, 3) float64, as stored."""
    tangents: np.ndarray | None
    """(n, 4) float64, w the sign of the bitangent, as stored."""
    uvs: tuple[np.ndarray | None, ...]
    """``UV_SETS`` times (n, 2) float64, v = 0 at the top row as glTF has it."""
    colors: np.ndarray | None
    """(n, 4) float64, linear, 1 as alpha where none is stored."""
    joints: np.ndarray | None
    """(n, 4 k) int64, the joints of a skin that move each vertex."""
    weights: np.ndarray | None
    """(n, 4 k) float64, how much."""
    material: int | None
    """The number of its material."""


def primitives_of(document: Document, number: int, weights: tuple[float, ...] | None) -> list[Primitive]:
    """The primitives of a mesh that have triangles.

    Args:
        document: the asset.
        number: of the mesh.
        weights: of its morph targets, as a node gives them; None for the mesh's own.

    Raises:
        InputError: one is not sound.
    """
    mesh = document.entries("meshes")[number]
    place = f"meshes[{number}]"
    own = mesh.get("weights", []) if weights is None else list(weights)
    if not isinstance(own, list):
        raise InputError(f"{place}.weights: should be a list of numbers")
    found = []
    for index, entry in enumerate(document.entries("primitives", of=mesh, place=place)):
        where = f"{place}.primitives[{index}]"
        mode = entry.get("mode", TRIANGLES)
        if not isinstance(mode, int) or mode not in (*WITHOUT_SURFACE, TRIANGLES, STRIP, FAN):
            raise InputError(f"{where}.mode: allowed are 0 to 6, got {mode!r:.40}")
        if mode in WITHOUT_SURFACE:
            continue
        primitive = _primitive(document, entry, where, mode, own)
        if primitive is not None:
            found.append(primitive)
    return found


def modes_without_surface(document: Document) -> set[str]:
    """What the asset has that has no surface: points, lines."""
    modes: set[str] = set()
    for number, mesh in enumerate(document.entries("meshes")):
        for entry in document.entries("primitives", of=mesh, place=f"meshes[{number}]"):
            mode = entry.get("mode")
            if isinstance(mode, int) and mode in WITHOUT_SURFACE:
                modes.add(WITHOUT_SURFACE[mode])
    return modes


def _primitive(document: Document, entry: Table, where: str, mode: int, weights: list[Any]) -> Primitive | None:
    """A primitive with triangles; None if it has none."""
    attributes = document.table(entry.get("attributes"), f"{where}.attributes")
    compressed = document.extension(entry, "KHR_draco_mesh_compression", where)
    unpacked = {} if compressed is None else draco_attributes(document, compressed, attributes, where)

    def stored(name: str) -> np.ndarray | None:
        if name in unpacked:
            return unpacked[name]
        return elements(document, attributes[name], f"{where}.attributes.{name}") if name in attributes else None

    def real(name: str, width: int, *, always: bool = False) -> np.ndarray | None:
        return _real(document, attributes, where, name, width, stored, is_fraction=always)

    vertices = real("POSITION", 3)
    if vertices is None:
        return None  # 3.7.2.1: without positions it is not drawn
    faces = _faces(unpacked.get("indices"), document, entry, where, mode, len(vertices))
    if len(faces) == 0:
        return None
    normals, tangents = real("NORMAL", 3), real("TANGENT", 4)
    uvs = tuple(real(f"TEXCOORD_{k}", 2) for k in range(UV_SETS))
    colors = _colors(real("COLOR_0", 0, always=True), f"{where}.attributes.COLOR_0")
    joints, influences = _influences(stored, real)
    for name, values_of in (("NORMAL", normals), ("TANGENT", tangents), ("COLOR_0", colors), ("WEIGHTS_0", influences)):
        if values_of is not None and len(values_of) != len(vertices):
            raise InputError(f"{where}.attributes.{name}: {len(values_of)} for {len(vertices)} positions")
    for k, uv in enumerate(uvs):
        if uv is not None and len(uv) != len(vertices):
            raise InputError(f"{where}.attributes.TEXCOORD_{k}: {len(uv)} for {len(vertices)} positions")
    vertices, normals, tangents, uvs, colors = _morphed(
        document, entry, where, weights, (vertices, normals, tangents, uvs, colors)
    )
    material = entry.get("material")
    if material is not None:
        document.entry("materials", material, f"{where}.material")
    return Primitive(vertices, faces, normals, tangents, uvs, colors, joints, influences, material)


def _real(
    document: Document,
    attributes: Table,
    where: str,
    name: str,
    width: int,
    stored: Callable[[str], np.ndarray | None],
    *,
    is_fraction: bool,
) -> np.ndarray | None:
    """An attribute as (n, ``width``) float64; with a width of 0 it may have any. None if there is none.

    Integers are fractions if the accessor is ``normalized``, or ``is_fraction``: those of colours must be.
    """
    found = stored(name)
    if found is None:
        return None
    if found.ndim != 2 or (width and found.shape[1] != width):
        raise InputError(f"{where}.attributes.{name}: should have {width or '3 or 4'} components")
    accessor = document.entry("accessors", attributes[name], f"{where}.attributes.{name}")
    if accessor.get("normalized") is True or is_fraction:
        return fractions(found)
    return found.astype(np.float64)


def _faces(
    unpacked: np.ndarray | None, document: Document, entry: Table, where: str, mode: int, vertices: int
) -> np.ndarray:
    """(m, 3) int64 triangles of a list, a strip or a fan (3.7.2.1)."""
    if unpacked is not None:
        indices, mode = unpacked.astype(np.int64), TRIANGLES  # what is unpacked are triangles, whatever they were
    elif entry.get("indices") is not None:
        indices = elements(document, entry["indices"], f"{where}.indices")
        if indices.ndim != 1 or indices.dtype.kind != "u":
            raise InputError(f"{where}.indices: should be unsigned whole numbers")
        indices = indices.astype(np.int64)
    else:
        indices = np.arange(vertices, dtype=np.int64)
    if mode == TRIANGLES:
        faces = indices[: len(indices) // 3 * 3].reshape(-1, 3)
    else:
        faces = _of_strip(indices) if mode == STRIP else _of_fan(indices)
    if faces.size and faces.max() >= vertices:
        raise InputError(f"{where}.indices: there is no vertex {faces.max()} (it has {vertices})")
    return faces


def _of_strip(indices: np.ndarray) -> np.ndarray:
    """Triangles of a strip: every second one is turned, so that all face the same way."""
    if len(indices) < 3:
        return np.zeros((0, 3), np.int64)
    a, b, c = indices[:-2], indices[1:-1], indices[2:]
    is_odd = np.arange(len(a)) % 2 == 1
    return np.stack([a, np.where(is_odd, c, b), np.where(is_odd, b, c)], axis=1)


def _of_fan(indices: np.ndarray) -> np.ndarray:
    """Triangles of a fan, as the specification writes them: the fan's first vertex is each one's last."""
    if len(indices) < 3:
        return np.zeros((0, 3), np.int64)
    return np.stack([indices[1:-1], indices[2:], np.full(len(indices) - 2, indices[0])], axis=1)


def _colors(stored: np.ndarray | None, where: str) -> np.ndarray | None:
    """(n, 4) colours of vertices, finite and not negative."""
    if stored is None:
        return None
    if stored.shape[1] not in (3, 4):
        raise InputError(f"{where}: should have 3 or 4 components")
    colors = np.ones((len(stored), 4))
    colors[:, : stored.shape[1]] = np.where(np.isfinite(stored), np.maximum(stored, 0.0), 0.0)
    colors[:, 3] = np.minimum(colors[:, 3], 1.0)
    return colors


def _influences(
    stored: Callable[[str], np.ndarray | None], real: Callable[[str, int], np.ndarray | None]
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Joints and weights of a skin, all sets side by side."""
    joints, weights = [], []
    for k in range(MOST_TARGETS):
        numbers, shares = stored(f"JOINTS_{k}"), real(f"WEIGHTS_{k}", 4)
        if numbers is None or shares is None:
            break
        if numbers.shape != shares.shape:
            raise InputError(f"JOINTS_{k} and WEIGHTS_{k} do not fit each other")
        joints.append(numbers.astype(np.int64))
        weights.append(shares)
    return (np.hstack(joints), np.hstack(weights)) if joints else (None, None)


_Attributes = tuple[np.ndarray, np.ndarray | None, np.ndarray | None, tuple[np.ndarray | None, ...], np.ndarray | None]


def _morphed(document: Document, entry: Table, where: str, weights: list[Any], attributes: _Attributes) -> _Attributes:
    """Attributes with those of the morph targets added, times their weights (3.7.2.2)."""
    targets = document.entries("targets", of=entry, place=where)
    if len(targets) > MOST_TARGETS:
        raise InputError(f"{where}.targets: at most {MOST_TARGETS} are allowed, got {len(targets)}")
    vertices, normals, tangents, uvs, colors = attributes
    for index, (target, weight) in enumerate(zip(targets, weights, strict=False)):
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not abs(weight) < np.inf:
            raise InputError(f"{where}: the weights of morph targets should be numbers, got {weight!r:.40}")
        if weight == 0.0:
            continue

        def added(base: np.ndarray | None, name: str, place: str, of=target, share=weight) -> np.ndarray | None:  # type: ignore[no-untyped-def]
            if base is None or name not in of:
                return base
            offset = values(document, of[name], f"{place}.{name}")
            if offset.ndim != 2 or len(offset) != len(base) or offset.shape[1] > base.shape[1]:
                raise InputError(f"{place}.{name}: it does not fit what it is added to")
            result = base.copy()
            result[:, : offset.shape[1]] += share * offset
            return result

        place = f"{where}.targets[{index}]"
        moved = added(vertices, "POSITION", place)
        assert moved is not None
        vertices = moved
        normals, tangents = added(normals, "NORMAL", place), added(tangents, "TANGENT", place)
        uvs = tuple(added(uv, f"TEXCOORD_{k}", place) for k, uv in enumerate(uvs))
        colors = added(colors, "COLOR_0", place)
    return vertices, normals, tangents, uvs, colors
