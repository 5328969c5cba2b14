"""The node hierarchy of a scene (glTF 2.0, 3.5): where meshes, cameras and lights stand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.accessors import values
from ldtrefl.scene.gltf.container import Document, Table

INSTANCE_BYTES = 1 << 10
"""What an instance takes until it is an object."""


@dataclass(frozen=True, eq=False)
class Node:
    """A node of the scene, in its place."""

    number: int
    name: str
    matrix: np.ndarray
    """(4, 4) float64: the scene's coordinates from its own."""
    entry: Table
    instances: np.ndarray | None
    """(k, 4, 4) float64: the places of the instances of its mesh in its own coordinates (EXT_mesh_gpu_instancing)."""


def nodes_of_scene(document: Document) -> list[Node]:
    """The nodes of the scene that the file shows, parents before their children; of all scenes if it names none.

    Raises:
        InputError: a node stands in itself or in two others, or a matrix is not finite.
    """
    entries = document.entries("nodes")
    found: list[Node] = []
    seen: set[int] = set()
    waiting = [(number, np.eye(4), place) for number, place in reversed(list(_roots(document, entries)))]
    while waiting:
        number, parent, place = waiting.pop()
        entry = document.entry("nodes", number, place)
        if number in seen:
            raise InputError(f"{place}: nodes[{number}] stands in itself, or in two nodes")
        seen.add(number)
        where = f"nodes[{number}]"
        matrix = _product(parent, _local(document, entry, where))
        if not np.isfinite(matrix).all():
            raise InputError(f"{where}: where it stands is not finite")
        found.append(Node(number, document.name(entry), matrix, entry, _instances(document, entry, where)))
        children = entry.get("children", [])
        if not isinstance(children, list):
            raise InputError(f"{where}.children: should be a list")
        waiting += [(child, matrix, f"{where}.children") for child in reversed(children)]
    return found


def _roots(document: Document, entries: list[Table]) -> Iterator[tuple[Any, str]]:
    """(number, what refers to it) of the nodes that stand in no other."""
    scenes = document.entries("scenes")
    if not scenes:
        inner = {child for entry in entries for child in _children(entry)}
        yield from ((number, "nodes") for number in range(len(entries)) if number not in inner)
        return
    number = document.root.get("scene", 0)
    shown = document.entry("scenes", number, "scene")
    listed = shown.get("nodes", [])
    if not isinstance(listed, list):
        raise InputError(f"scenes[{number}].nodes: should be a list")
    yield from ((root, f"scenes[{number}].nodes") for root in listed)


def _children(entry: Table) -> list[int]:
    children = entry.get("children", [])
    return [child for child in children if isinstance(child, int)] if isinstance(children, list) else []


def _local(document: Document, entry: Table, where: str) -> np.ndarray:
    """(4, 4): the place of a node in its parent's."""
    if "matrix" in entry:
        stored = document.numbers(entry, "matrix", where, tuple(np.eye(4).reshape(-1)))
        return np.array(stored).reshape(4, 4).T
    translation = document.numbers(entry, "translation", where, (0.0, 0.0, 0.0))
    rotation = document.numbers(entry, "rotation", where, (0.0, 0.0, 0.0, 1.0))
    scale = document.numbers(entry, "scale", where, (1.0, 1.0, 1.0))
    return matrices_of(np.array([translation]), np.array([rotation]), np.array([scale]))[0]


def matrices_of(translations: np.ndarray, rotations: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """(n, 4, 4) of (n, 3), (n, 4) quaternions x, y, z, w of any length, and (n, 3)."""
    length = np.sqrt((rotations**2).sum(axis=1, keepdims=True))
    with np.errstate(all="ignore"):
        x, y, z, w = np.where(length > 0.0, rotations / length, [0.0, 0.0, 0.0, 1.0]).T
    made = np.zeros((len(translations), 4, 4))
    made[:, 0, 0], made[:, 0, 1], made[:, 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    made[:, 1, 0], made[:, 1, 1], made[:, 1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    made[:, 2, 0], made[:, 2, 1], made[:, 2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
    made[:, :3, :3] *= scales[:, None, :]
    made[:, :3, 3] = translations
    made[:, 3, 3] = 1.0
    return made


def _instances(document: Document, entry: Table, where: str) -> np.ndarray | None:
    """The places of the instances of a node's mesh."""
    extension = document.extension(entry, "EXT_mesh_gpu_instancing", where)
    if extension is None:
        return None
    place = f"{where}.extensions.EXT_mesh_gpu_instancing.attributes"
    attributes = document.table(extension.get("attributes"), place)
    found: dict[str, np.ndarray] = {}
    for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)):
        if name in attributes:
            found[name] = values(document, attributes[name], f"{place}.{name}")
            if found[name].ndim != 2 or found[name].shape[1] != width:
                raise InputError(f"{place}.{name}: should have {width} components")
    if not found:
        return None
    counts = {len(of) for of in found.values()}
    if len(counts) > 1:
        raise InputError(f"{place}: they have different numbers of instances")
    (count,) = counts
    budget.take(INSTANCE_BYTES * count, f"{count} instances of {where}")
    return matrices_of(
        found.get("TRANSLATION", np.zeros((count, 3))),
        found.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))),
        found.get("SCALE", np.ones((count, 3))),
    )


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The product of two matrices. Not by BLAS, whose threads go on spinning afterwards."""
    return np.einsum("ij,jk->ik", a, b)
