"""A glTF file as parts of a scene: an object for each node that has a mesh, with its materials; lights and cameras.

glTF is y up and metres; its light is in lux and candela, and a white surface sends back 1 / pi of what falls on it.
"""

from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ldtrefl.base import budget
from ldtrefl.base.checked import BRIGHTEST
from ldtrefl.base.errors import InputError, printable
from ldtrefl.scene.decomposition import placed
from ldtrefl.scene.description import Camera, Light, Object
from ldtrefl.scene.gltf.asset import Asset, MeshNode
from ldtrefl.scene.gltf.lights import CameraNode, LightNode
from ldtrefl.scene.gltf.pieces import pieces_of
from ldtrefl.scene.joining import joined_mesh, joining_bytes
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.piece import NARROWEST_SHARE, axes_left, moved
from ldtrefl.scene.readers.archives import mesh_files
from ldtrefl.scene.readers.files_beside import Beside
from ldtrefl.scene.scene_parts import OBJECT_BYTES, SceneParts

PIXELS = 768 * 512
"""Of an image whose camera says how wide it is for its height."""

WIDEST = 64.0
"""Width over height, or height over width, of an image at most."""

UPRIGHT = {
    "x": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    "-x": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "y": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-y": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "z": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "-z": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
}
"""Rotations that turn +y to an axis, by its name; the shortest turn."""

_log = logging.getLogger("ldtrefl")


def scene_parts(path: Path, *, up: str = "z", lenient: bool = False) -> SceneParts:
    """What a glTF file holds, turned so that it stands upright. What it holds and is not shown is named in a warning.

    Args:
        path: the file, ``.gltf`` or ``.glb``, or an archive with one.
        up: the axis that points up in the scene, one of ``UPRIGHT``.
        lenient: read what can be read of a file that requires extensions which are not.

    Raises:
        InputError: it is no glTF 2.0, or not sound; the message names the file.
    """
    turn = np.eye(4)
    turn[:3, :3] = UPRIGHT[up]
    with faults_of(path):
        asset = read_asset(path, lenient=lenient)
        parts, lines = _Builder(asset, turn).parts()
    for line in [*asset.not_shown(), *lines]:
        _log.warning("%s: not shown: %s", path, printable(line))
    return parts


@contextlib.contextmanager
def faults_of(path: Path) -> Iterator[None]:
    """Whatever a damaged file provokes inside this block is the file's fault, and names it.

    Raises:
        InputError: in one line.
    """
    try:
        with budget.account(), np.errstate(all="ignore"):
            yield
    except InputError as error:
        raise error.within(str(path)) from None
    except Exception as error:
        raise InputError(f"{path}: not a scene that can be read ({type(error).__name__}: {error})") from error


def read_asset(path: Path, *, lenient: bool = False) -> Asset:
    """The asset in a glTF file, or in an archive with one. Its meshes and materials are read when they are asked for.

    Raises:
        InputError: there is no such file, or it is no glTF 2.0.
    """
    if not path.is_file():
        raise InputError("no such file")
    data, beside = _only_file(path)
    return Asset.read(data, beside, lenient=lenient)


def _only_file(path: Path) -> tuple[bytes, Beside]:
    """The bytes of a glTF file, and what reads files beside it."""
    found = [(data, beside.get) for data, kind, beside in mesh_files(str(path)) if kind in ("glb", "gltf")]
    if len(found) != 1:
        raise InputError(f"one glTF file is needed, got {len(found)}")
    return found[0]


class _Builder:
    """Turns an asset into parts of a scene."""

    def __init__(self, asset: Asset, turn: np.ndarray) -> None:
        self.asset, self.turn = asset, turn
        self.not_shown: list[str] = []
        self._meshes: dict[tuple[int, bytes | None], Mesh] = {}
        self._kept: list[object] = []
        """What the keys of ``_meshes`` are the addresses of."""
        self._used: dict[str, int] = {}

    def parts(self) -> tuple[SceneParts, list[str]]:
        """The parts, and what of the nodes is not shown."""
        objects = tuple(self._objects())
        lights = tuple(self._light(light) for light in self.asset.lights())
        cameras: list[Camera] = []
        names: list[str] = []
        for node in self.asset.cameras():
            if node.is_perspective:
                cameras.append(self._camera(node))
                names.append(node.name or f"camera {len(names)}")
            else:
                self.not_shown.append(f"camera '{node.name}' (orthographic)")
        return SceneParts(objects, lights, tuple(cameras), tuple(names)), self.not_shown

    def _objects(self) -> Iterator[Object]:
        for node in self.asset.mesh_nodes():
            matrix = np.einsum("ij,jk->ik", self.turn, node.matrix)
            axes = axes_left(matrix[:3, :3])
            flattening = matrix[:3, :3] if axes == 2 else None
            mesh = self._mesh(node, flattening) if axes >= 2 else None
            if mesh is None or (flattening is not None and _is_a_line(mesh)):
                self.not_shown.append(f"node '{node.name}' (its scale leaves it no size)")
                continue
            if flattening is not None:
                matrix[:3, :3] = np.eye(3)  # the mesh is flat already
            budget.take(OBJECT_BYTES, "an object")
            try:
                yield Object(name=self._name(node.name), mesh=mesh, **placed(matrix))
            except InputError as error:
                raise error.within(f"node '{node.name}'") from None

    def _mesh(self, node: MeshNode, flattening: np.ndarray | None) -> Mesh:
        """The mesh of a node; nodes with the same primitives share one. An object cannot be placed by a matrix that
        flattens it, (3, 3): its mesh is made flat in its place."""
        key = (id(node.primitives), None if flattening is None else flattening.tobytes())
        if key not in self._meshes:
            pieces = pieces_of(node.primitives, self.asset.materials)
            if flattening is not None:
                matrix = np.eye(4)
                matrix[:3, :3] = flattening
                pieces = [moved(piece, matrix) for piece in pieces]
            budget.take(joining_bytes(pieces), f"the mesh of '{node.name}'")
            self._meshes[key] = joined_mesh(pieces)
            self._kept.append(node.primitives)
        return self._meshes[key]

    def _name(self, name: str) -> str:
        """A name that no object before has."""
        number = self._used.get(name, 0)
        self._used[name] = number + 1
        return name if number == 0 else self._name(f"{name}.{number}")

    def _light(self, light: LightNode) -> Light:
        red, green, blue = (min(channel / math.pi, BRIGHTEST) for channel in light.color)
        if light.kind == "directional":
            direction = self.turn[:3, :3] @ light.direction
            return Light(kind="directional", direction=_three(direction), radiance=(red, green, blue))
        position = _three(self.turn[:3, :3] @ light.position)
        if light.kind == "spot":
            outer = min(max(math.degrees(light.cone[1]), 0.0), 90.0)
            inner = min(max(math.degrees(light.cone[0]), 0.0), outer)
            direction = _three(self.turn[:3, :3] @ light.direction)
            return Light(
                kind="spot",
                position=position,
                direction=direction,
                intensity=(red, green, blue),
                inner_angle=inner,
                outer_angle=outer,
            )
        return Light(kind="point", position=position, intensity=(red, green, blue))

    def _camera(self, node: CameraNode) -> Camera:
        eye, forward, up = (self.turn[:3, :3] @ vector for vector in (node.position, node.forward, node.up))
        size: dict[str, Any] = {}
        if node.aspect is not None:
            aspect = min(max(node.aspect, 1.0 / WIDEST), WIDEST)
            height = round(math.sqrt(PIXELS / aspect))
            size = {"width": round(height * aspect), "height": height}
        reach = max(1.0, float(np.abs(eye).max()))  # how far it looks is all the same
        return Camera(eye=_three(eye), look_at=_three(eye + reach * forward), up=_three(up), fov_y=node.fov_y, **size)


def _is_a_line(mesh: Mesh) -> bool:
    """Whether all triangles of a mesh lie on one line."""
    used = mesh.vertices[mesh.is_used]
    centred = used - used.mean(axis=0)
    spread = np.linalg.eigvalsh(np.einsum("ni,nj->ij", centred, centred))
    return not spread[1] > NARROWEST_SHARE**2 * spread[2]


def _three(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in vector)
    return x, y, z
