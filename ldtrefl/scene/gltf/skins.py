"""Skins in their bind pose (glTF 2.0, 3.7.3): vertices moved by the joints as these stand in the file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ldtrefl.base.errors import InputError
from ldtrefl.scene.gltf.accessors import values
from ldtrefl.scene.gltf.container import Document
from ldtrefl.scene.gltf.primitives import Primitive


def joint_matrices(document: Document, number: object, place: str, world: dict[int, np.ndarray]) -> np.ndarray:
    """(joints, 4, 4) float64: the scene's coordinates of what a joint of a skin moves.

    Args:
        document: the asset.
        number: of the skin.
        place: what refers to it.
        world: the matrices of all nodes of the scene.

    Raises:
        InputError: there is no such skin, or a joint or matrix of it is missing.
    """
    entry = document.entry("skins", number, place)
    where = f"skins[{number}]"
    joints = entry.get("joints", [])
    if not isinstance(joints, list) or not joints:
        raise InputError(f"{where}.joints: should be a list of one node or more")
    for joint in joints:
        document.entry("nodes", joint, f"{where}.joints")
        if joint not in world:
            raise InputError(f"{where}.joints: nodes[{joint}] does not stand in the scene")
    matrices = np.array([world[joint] for joint in joints])
    if entry.get("inverseBindMatrices") is None:
        return matrices
    stored = values(document, entry["inverseBindMatrices"], f"{where}.inverseBindMatrices")
    if stored.ndim != 2 or stored.shape[1] != 16 or len(stored) < len(joints):
        raise InputError(f"{where}.inverseBindMatrices: {len(joints)} matrices are needed, got {len(stored)}")
    return np.einsum("nij,njk->nik", matrices, stored[: len(joints)].reshape(-1, 4, 4))


def posed(primitive: Primitive, joints: np.ndarray, where: str) -> Primitive:
    """A primitive in the scene's coordinates, its vertices moved by (joints, 4, 4) matrices.

    Raises:
        InputError: a vertex has a joint that there is not.
    """
    numbers, weights = primitive.joints, primitive.weights
    if numbers is None or weights is None:
        return primitive
    if numbers.size and numbers.max() >= len(joints):
        raise InputError(f"{where}: there is no joint {numbers.max()} (the skin has {len(joints)})")
    total = weights.sum(axis=1, keepdims=True)
    shares = np.divide(weights, total, out=np.zeros_like(weights), where=total > 0.0)
    shares[total[:, 0] <= 0.0, 0] = 1.0
    # A joint at a time: a matrix for each vertex would take 128 bytes.
    vertices, normals, tangents = np.zeros_like(primitive.vertices), primitive.normals, primitive.tangents
    turned = None if normals is None else np.zeros_like(normals)
    bent = None if tangents is None else np.zeros((len(tangents), 3))
    for column in range(numbers.shape[1]):
        share, of = shares[:, column, None], numbers[:, column]
        for joint in np.unique(of[share[:, 0] != 0.0]).tolist():
            rows = np.flatnonzero((of == joint) & (share[:, 0] != 0.0))
            matrix, weight = joints[joint], share[rows]
            moved = np.einsum("ni,ki->nk", primitive.vertices[rows], matrix[:3, :3]) + matrix[:3, 3]
            vertices[rows] += weight * moved
            if normals is not None and turned is not None:
                cofactors = np.cross(matrix[[1, 2, 0], :3], matrix[[2, 0, 1], :3])
                turned[rows] += weight * np.einsum("ni,ki->nk", normals[rows], cofactors)
            if tangents is not None and bent is not None:
                bent[rows] += weight * np.einsum("ni,ki->nk", tangents[rows, :3], matrix[:3, :3])
    bent_tangents = None if tangents is None or bent is None else np.hstack([bent, tangents[:, 3:]])
    return replace(primitive, vertices=vertices, normals=turned, tangents=bent_tangents, joints=None, weights=None)
