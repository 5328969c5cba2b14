"""Primitives of a glTF asset as pieces of a mesh."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ldtrefl.base import budget
from ldtrefl.scene.gltf.asset import Asset
from ldtrefl.scene.gltf.materials import Materials
from ldtrefl.scene.gltf.primitives import Primitive
from ldtrefl.scene.piece import Piece, moved, unit_vectors
from ldtrefl.scene.surface_material import SurfaceMaterial, Texture

PLACED_BYTES = 100
"""Bytes of a vertex of a piece, with its share of triangles: less than what is needed to join pieces."""


def placed_pieces(asset: Asset) -> list[Piece]:
    """All pieces of an asset's scene where its nodes place them.

    Raises:
        InputError: something of it is not sound, or all its pieces need more memory than is allowed.
    """
    nodes = list(asset.mesh_nodes())
    with budget.given_back():  # a mesh may stand in very many places: to make the copies would take long
        vertices = sum(len(one.vertices) for node in nodes for one in node.primitives)
        budget.take(PLACED_BYTES * vertices, "its mesh")
    return [moved(piece, node.matrix) for node in nodes for piece in pieces_of(node.primitives, asset.materials)]


def pieces_of(primitives: Iterable[Primitive], materials: Materials) -> list[Piece]:
    """Primitives in their mesh's own coordinates. Those without normals are flat (3.7.2.1): their normals are 0.

    Raises:
        InputError: a material is not sound.
    """
    return [
        Piece(
            one.vertices,
            one.faces,
            np.zeros(one.vertices.shape) if one.normals is None else unit_vectors(one.normals),
            _upright(one.uvs[0]),
            _look(one, materials),
            _upright(one.uvs[1]),
            None if one.colors is None else one.colors.astype(np.float32),
            None if one.tangents is None or one.normals is None else unit_vectors(one.tangents),
        )
        for one in primitives
    ]


def _look(primitive: Primitive, materials: Materials) -> SurfaceMaterial:
    """The material of a primitive, without textures for which it has no coordinates."""
    material = materials.material(primitive.material)
    lost: dict[str, Any] = {
        name: None
        for name, value in vars(material).items()
        if isinstance(value, Texture) and (value.uv_set >= len(primitive.uvs) or primitive.uvs[value.uv_set] is None)
    }
    if not lost:
        return material
    line = f"a texture of material '{material.name}': a primitive has no texture coordinates for it"
    if line not in materials.faults:
        materials.faults.append(line)
    return replace(material, **lost)


def _upright(uvs: np.ndarray | None) -> np.ndarray | None:
    """(n, 2) float32 texture coordinates with v = 0 at the bottom row; those that are not finite become 0."""
    if uvs is None:
        return None
    turned = np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1)
    turned[~np.isfinite(turned).all(axis=1)] = 0.0
    return turned.astype(np.float32)
