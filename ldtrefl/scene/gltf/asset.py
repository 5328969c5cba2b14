"""A glTF asset, read whole: what stands in its scene, and where.

    a file -> Document (container.py) -> nodes in their places (nodes.py) -> primitives, lights, cameras

Nothing of the files around it is read but what it names in its own folder.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.container import Document
from ldtrefl.scene.gltf.extensions import check_required, not_shown
from ldtrefl.scene.gltf.lights import CameraNode, LightNode, camera_of, light_of
from ldtrefl.scene.gltf.materials import Materials
from ldtrefl.scene.gltf.nodes import Node, nodes_of_scene
from ldtrefl.scene.gltf.primitives import Primitive, modes_without_surface, primitives_of
from ldtrefl.scene.gltf.skins import joint_matrices, posed
from ldtrefl.scene.readers.files_beside import Beside

_log = logging.getLogger("ldtrefl")


@dataclass(frozen=True, eq=False)
class MeshNode:
    """A mesh where a node places it."""

    name: str
    primitives: tuple[Primitive, ...]
    """Shared by all nodes that have the same mesh."""
    matrix: np.ndarray
    """(4, 4) float64: the scene's coordinates from the mesh's."""


@dataclass(eq=False)
class Asset:
    """What a glTF file holds. Meshes, lights and cameras are read when they are first asked for."""

    document: Document
    nodes: list[Node]
    """Of the scene that the file shows, parents before their children."""
    materials: Materials
    _meshes: dict[tuple[int, str], tuple[Primitive, ...]] = field(default_factory=dict)

    @classmethod
    def read(cls, data: bytes, beside: Beside, *, lenient: bool = False) -> Asset:
        """Read a file.

        Args:
            data: the file, ``.gltf`` or ``.glb``.
            beside: reads the files that it names.
            lenient: go on where it requires extensions that are not read.

        Raises:
            InputError: it is no glTF 2.0, or requires what is not read.
        """
        document = Document(data, beside)
        check_required(document, lenient=lenient)
        return cls(document, nodes_of_scene(document), Materials(document))

    def mesh_nodes(self) -> Iterator[MeshNode]:
        """The meshes with triangles, where they stand; those of skins in their pose.

        Raises:
            InputError: one is not sound.
        """
        world = {node.number: node.matrix for node in self.nodes}
        for node in self.nodes:
            number, where = node.entry.get("mesh"), f"nodes[{node.number}]"
            if number is None:
                continue
            mesh = self.document.entry("meshes", number, f"{where}.mesh")
            name = node.name or self.document.name(mesh) or f"mesh {number}"
            primitives = self._primitives(number, node, where)
            if not primitives:
                continue
            if node.entry.get("skin") is not None and any(one.joints is not None for one in primitives):
                joints = joint_matrices(self.document, node.entry["skin"], f"{where}.skin", world)
                yield MeshNode(name, tuple(posed(one, joints, where) for one in primitives), np.eye(4))
            elif node.instances is not None:
                for k, place in enumerate(node.instances):
                    matrix = np.einsum("ij,jk->ik", node.matrix, place)
                    if not np.isfinite(matrix).all():
                        raise InputError(f"{where}: the place of instance {k} is not finite")
                    yield MeshNode(f"{name}.{k}", primitives, matrix)
            else:
                yield MeshNode(name, primitives, node.matrix)

    def _primitives(self, number: int, node: Node, where: str) -> tuple[Primitive, ...]:
        weights: tuple[float, ...] | None = None
        if "weights" in node.entry:
            stored = node.entry["weights"]
            if not isinstance(stored, list):
                raise InputError(f"{where}.weights: should be a list of numbers")
            weights = tuple(stored)
        key = (number, repr(weights))
        if key not in self._meshes:
            self._meshes[key] = tuple(primitives_of(self.document, number, weights))
        return self._meshes[key]

    def lights(self) -> list[LightNode]:
        """The lights of the scene."""
        found = (light_of(self.document, node) for node in self.nodes)
        return [light for light in found if light is not None]

    def cameras(self) -> list[CameraNode]:
        """The cameras of the scene."""
        found = (camera_of(self.document, node) for node in self.nodes)
        return [camera for camera in found if camera is not None]

    def not_shown(self) -> list[str]:
        """What the file holds and pictures of it do not show, a line each."""
        lines = not_shown(self.document)
        surfaceless = modes_without_surface(self.document)
        if surfaceless:
            lines.append(" and ".join(sorted(surfaceless)) + " (they have no surface)")
        if self.document.entries("animations"):
            lines.append("animations (shown as it stands)")
        return lines + self.materials.faults
