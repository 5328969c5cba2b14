"""What cases share as input: tracers of every kind, rays about a mesh and of a camera, a mesh scaled and moved."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

import ldtrefl
from ldtrefl.world.camera import camera_axes

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


def camera_rays(camera: ldtrefl.Camera) -> tuple[np.ndarray, np.ndarray]:
    """(h * w, 3) float64 origins and directions through the pixels' centres."""
    right, down, forward = camera_axes(camera)
    half = np.tan(np.radians(camera.fov_y / 2))
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    across = (2 * x / camera.width - 1) * half * camera.width / camera.height
    along = (2 * y / camera.height - 1) * half
    rays = forward + across[..., None] * right + along[..., None] * down
    return np.broadcast_to(np.asarray(camera.eye, float), (x.size, 3)), rays.reshape(-1, 3)
