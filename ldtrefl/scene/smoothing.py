"""Smooth normals for vertices of a mesh that have none of their own: rows of 0, which stand for the facet's."""

from __future__ import annotations

import numpy as np

from ldtrefl.base import budget
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.normals import split_by_side

BYTES_PER_VERTEX = 160.0
"""A vertex while pieces are joined, welded and smoothed, the mesh itself included; measured."""

BYTES_PER_TRIANGLE = 90.0
"""A triangle, likewise."""


def smoothed_facets(mesh: Mesh) -> Mesh:
    """The mesh with smooth normals where its file says that facets are flat, or knows of nothing else, as STL files do.

    Vertices that have a normal keep it. Those of one place count as one, whatever their materials.

    Raises:
        InputError: it takes more memory than is allowed.
    """
    if mesh.stored_normals is None:
        return mesh
    is_flat = (mesh.stored_normals == 0.0).all(axis=1)
    triangles = np.flatnonzero(is_flat[mesh.faces].all(axis=1))
    if not len(triangles):
        return mesh
    budget.take(BYTES_PER_VERTEX * len(is_flat) + BYTES_PER_TRIANGLE * len(mesh.faces), "its smooth normals")
    return smoothed(mesh, is_flat, triangles)


def smoothed(mesh: Mesh, is_chosen: np.ndarray, triangles: np.ndarray, pieces: np.ndarray | None = None) -> Mesh:
    """The mesh with smooth normals for some of its vertices, which are doubled where one would serve several sides.

    Args:
        mesh: it has normals, which the others keep.
        is_chosen: (n,) bool, the vertices.
        triangles: (k,) the triangles that count.
        pieces: (n,) numbers; vertices of different pieces are not welded.

    Raises:
        InputError: too many triangles, or more memory for their sides than is allowed.
    """
    every = len(triangles) == len(mesh.faces)
    sources, split, smooth = split_by_side(mesh.vertices, mesh.faces if every else mesh.faces[triangles], pieces)
    normals = np.where(is_chosen[sources][:, None], smooth, mesh.normals[sources])
    normals.flags.writeable = False
    if len(sources) == len(mesh.vertices):
        return mesh.with_normals(normals)
    faces = mesh.faces.copy()
    faces[triangles] = split
    uvs, *more = (None if of is None else of[sources] for of in (mesh.uvs, mesh.second_uvs, mesh.colors, mesh.tangents))
    named = dict(zip(("second_uvs", "colors", "tangents"), more, strict=True))
    return Mesh(mesh.vertices[sources], faces, normals, uvs, mesh.parts, **named)
