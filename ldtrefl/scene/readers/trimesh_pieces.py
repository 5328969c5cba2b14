"""Mesh files of kinds without a reader of our own, as trimesh reads them with what is installed -> pieces.

What it returns is walked here: each piece is placed by the nodes of the file's scene, its normals by the inverse
transpose, and a mirrored piece is wound the other way, so that it keeps its outside.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from trimesh.exchange.load import mesh_loaders
from trimesh.resolvers import Resolver

from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.piece import Piece, moved, unit_vectors
from ldtrefl.scene.readers.files_beside import NamedFiles
from ldtrefl.scene.readers.polygons import triangles_of
from ldtrefl.scene.readers.trimesh_materials import with_materials


class _AsResolver(Resolver):  # type: ignore[misc]
    """Files beside a mesh file as trimesh asks for them: to read, and no more."""

    def __init__(self, beside: NamedFiles, folder: str = "") -> None:
        self._beside, self._folder = beside, folder

    def get(self, key: str) -> bytes:
        """The bytes of a file."""
        return self._beside.get(self._folder + key)

    def write(self, name: str, data: object) -> None:
        """Nothing is written."""
        raise PermissionError(name)

    def namespaced(self, namespace: str) -> Resolver:
        """The files of a folder beside it."""
        return _AsResolver(self._beside, f"{self._folder}{namespace}/")

    def keys(self) -> list[str]:
        """Which files there are is not told."""
        return []


def pieces_by_trimesh(data: bytes, kind: str, beside: NamedFiles) -> list[Piece]:
    """The pieces of a mesh file in the order of its nodes, where these place them.

    Args:
        data: the file.
        kind: how its name ends, such as 'dae'.
        beside: reads the files that it names.

    Raises:
        InputError: a triangle has a vertex that there is not. Other exceptions: the file is damaged.
    """
    read = mesh_loaders[kind](file_obj=io.BytesIO(data), file_type=kind, resolver=_AsResolver(beside), metadata=None)
    if "geometry" not in read:
        geometry, nodes = {"": read}, [{"geometry": "", "frame_to": ""}]
    else:
        geometry = read["geometry"]
        nodes = read.get("graph") or [{"geometry": name, "frame_to": name} for name in geometry]
    found = {name: piece for name, entry in geometry.items() if (piece := _piece(entry)) is not None}
    own = dict(zip(found, with_materials(list(found.values())), strict=True))
    placed = _placed([_node(node) for node in nodes], read.get("base_frame", "world"))
    return [moved(own[name], matrix) for name, matrix in placed if name in own]


def _piece(entry: dict[str, Any]) -> tuple[Piece, object | None] | None:
    """A geometry of the reader's as a piece, and trimesh's material of it; None if it has no triangles."""
    faces, vertices = entry.get("faces"), entry.get("vertices")
    if faces is None or vertices is None or len(faces) == 0:
        return None
    faces = np.asarray(faces)
    if faces.ndim == 2 and faces.shape[1] == 4:
        faces = faces.reshape(-1)[triangles_of(np.asarray(vertices, float)[faces.reshape(-1)], np.full(len(faces), 4))]
    vertices = np.asarray(vertices, np.float64)
    if vertices.ndim == 2 and faces.ndim == 2 and faces.dtype.kind in "iu":
        if int(faces.min()) < 0 or int(faces.max()) >= len(vertices):
            Mesh(vertices, faces)  # says which triangle
    visual = entry.get("visual")
    normals = _stored_normals(entry.get("vertex_normals"), vertices)
    uvs = _stored_uvs(getattr(visual, "uv", None), len(vertices))
    return Piece(vertices, faces, normals, uvs), getattr(visual, "material", None)


def _stored_normals(stored: ArrayLike | None, vertices: np.ndarray) -> np.ndarray | None:
    """(n, 3) float64 normals as a file holds them; None if it has none that can be used.

    Those that are not finite become 0, which means undefined. Those far from unit length become unit vectors.
    """
    if stored is None or np.shape(stored) != vertices.shape:
        return None
    normals = unit_vectors(np.asarray(stored))
    return normals if normals.any() else None


def _stored_uvs(stored: ArrayLike | None, vertices: int) -> np.ndarray | None:
    """(vertices, 2) float32 texture coordinates as a file holds them; None if it has none that can be used."""
    if stored is None or np.shape(stored) != (vertices, 2) or not np.isfinite(stored).all():
        return None
    return np.asarray(stored, np.float32)


def _node(node: Any) -> dict[str, Any]:
    """A node of trimesh's scene graph by names: 'frame_to', 'frame_from', 'geometry', 'matrix'. Some readers give it as
    a tuple."""
    return node if isinstance(node, dict) else {"frame_to": node[1], "frame_from": node[0], **node[2]}


def _placed(nodes: list[dict[str, Any]], base: str) -> list[tuple[str, np.ndarray]]:
    """(name of a geometry, (4, 4) matrix of its place in the file's world), node by node."""
    parents = {node["frame_to"]: node for node in reversed(nodes)}
    known: dict[str, np.ndarray] = {base: np.eye(4)}

    def world(frame: str) -> np.ndarray:
        # Not by recursion: a chain of nodes may be as long as the file.
        chain = []
        while frame not in known and frame in parents:
            chain.append(parents[frame])
            known[frame] = np.eye(4)  # so that a loop of nodes comes to an end
            frame = parents[frame].get("frame_from", base)
        matrix = known.get(frame, np.eye(4))
        for node in reversed(chain):
            matrix = known[node["frame_to"]] = _product(matrix, _matrix(node))
        return matrix

    return [
        (node["geometry"], _product(world(node.get("frame_from", base)), _matrix(node)))
        for node in nodes
        if node.get("geometry") is not None
    ]


def _matrix(node: dict[str, Any]) -> np.ndarray:
    """(4, 4): the place of a node in its parent's."""
    matrix = node.get("matrix")
    return np.eye(4) if matrix is None else np.asarray(matrix, np.float64).reshape(4, 4)


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The product of two matrices. Not by BLAS, whose threads go on spinning afterwards."""
    return np.einsum("ij,jk->ik", a, b)
