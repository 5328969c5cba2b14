"""A wavy sheet, and vertex normals by an outside program."""

import numpy as np
import trimesh


def plain_mean(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """trimesh's: vertices at one place welded, all faces there averaged by angle."""
    _, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    inverse = inverse.reshape(-1)
    centre, size = vertices.mean(axis=0), float(np.ptp(vertices, axis=0).max()) or 1.0
    welded = trimesh.Trimesh((vertices[first] - centre) / size, inverse[faces], process=False, validate=False)
    return np.nan_to_num(welded.vertex_normals[inverse])


def sheet(count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """A wavy sheet of 2 * count * count triangles."""
    x, y = np.meshgrid(*[np.linspace(0, 1, count + 1)] * 2)
    vertices = np.stack([x, y, 0.1 * np.sin(7 * x) * np.cos(5 * y)], -1).reshape(-1, 3)
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).reshape(-1)
    right, up = corner + 1, corner + count + 1
    return vertices, np.concatenate([np.stack([corner, right, up + 1], 1), np.stack([corner, up + 1, up], 1)])
