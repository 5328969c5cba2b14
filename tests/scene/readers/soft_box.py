"""A box whose corners have normals that no rule would give them, and what a GLB file says of it."""

import numpy as np
import trimesh


def soft_box() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A box with 36 corners of its own, each with a normal that no rule would give it: (positions, normals, order)."""
    box = trimesh.creation.box()
    positions = box.vertices[box.faces].reshape(-1, 3).astype(np.float32)
    normals = np.random.default_rng(0).normal(size=(36, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    return positions, normals, np.arange(36, dtype=np.uint32)


MESH = [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}]

SCENE = [{"nodes": [0]}]
