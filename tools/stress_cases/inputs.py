"""What cases give to tracers, and the tracers: rays about a mesh, a mesh elsewhere, every search and quality."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

import ldtrefl

from .outcomes import TEXELS


def tracers(mesh: ldtrefl.Mesh, resolution: int = TEXELS, **options: int) -> Iterator[tuple[str, Callable]]:
    """(name, ``trace(origins, directions) -> Hits``) of every search, every quality and the BVH."""
    for quality in ("exact", "balanced", "fast"):
        yield quality, ldtrefl.peel(mesh.vertices, mesh.faces, resolution, quality=quality).trace
    maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution, search="linear")
    yield "linear", lambda o, d: maps.trace(o, d, search="linear", **options)
    yield "bvh", ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace


def rays_about(mesh: ldtrefl.Mesh, count: int, seed: int = 0, reach: float = 2.5) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) float32 origins on a sphere about the mesh, and unit directions towards points of its box."""
    rng = np.random.default_rng(seed)
    centre, half = mesh.unit_frame
    around = rng.normal(size=(count, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    origins = (centre + reach * half * around).astype(np.float32)
    directions = rng.uniform(mesh.bounds[0], mesh.bounds[1], (count, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return origins, directions.astype(np.float32)


def moved(mesh: ldtrefl.Mesh, scale: object = 1.0, offset: object = 0.0) -> ldtrefl.Mesh:
    """The mesh scaled and moved."""
    return ldtrefl.Mesh(mesh.vertices * np.asarray(scale) + np.asarray(offset), mesh.faces)
