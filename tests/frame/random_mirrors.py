"""Mirror triangles of many sizes and places, the rays that leave them, and spheres that these meet."""

from __future__ import annotations

import numpy as np
import warp as wp

from ldtrefl.device import launch


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def on_device(vectors: np.ndarray) -> wp.array:
    return wp.array(vectors.astype(np.float32), dtype=wp.vec3, device=launch.resolve_device(None))


def random_mirrors(n: int, bend: float) -> dict[str, np.ndarray]:
    """Eyes, and triangles of many sizes and places, their corner normals bent by up to ``bend``."""
    rng = np.random.default_rng(11)
    size = 10.0 ** rng.uniform(-3, 0.5, (n, 1, 1))
    corners = rng.normal(size=(n, 1, 3)) + size * rng.normal(size=(n, 3, 3))
    facet = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    normals = unit(facet[:, None] + bend * rng.uniform(0, 1, (n, 1, 1)) * rng.normal(size=(n, 3, 3)))
    return {"eye": 4 * rng.normal(size=(n, 3)), "corners": corners, "normals": normals, "facet": facet}


def reflected(mirrors: dict[str, np.ndarray], samples: int, flat: bool) -> tuple[np.ndarray, np.ndarray]:
    """(n, samples, 3) origins and unit directions of rays from random points of each triangle."""
    n = len(mirrors["eye"])
    weights = np.random.default_rng(12).dirichlet((0.7, 0.7, 0.7), (n, samples))
    point = weights @ mirrors["corners"]
    normal = unit(np.repeat(mirrors["facet"][:, None], samples, axis=1) if flat else weights @ mirrors["normals"])
    view = unit(point - mirrors["eye"][:, None])
    return point, view - 2 * (view * normal).sum(axis=-1, keepdims=True) * normal


def meet(origins: np.ndarray, directions: np.ndarray, centre: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Whether rays meet spheres; the last axis of the vectors goes, the others broadcast."""
    offset = centre - origins
    along = (offset * directions).sum(axis=-1)
    aside = (offset**2).sum(axis=-1) - along**2
    return ((offset**2).sum(axis=-1) <= radius**2) | ((aside <= radius**2) & (along > 0))
