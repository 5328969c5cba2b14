"""What tests share: real meshes where they are, rays, and tracing by a third tracer."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import ldtrefl
from ldtrefl import shapes

SCENES = Path(__file__).parent.parent / "scenes"

REAL_MESHES = (
    "armadillo.ply",
    "boot.ply",
    "bunny_open.ply",
    "cycloidal_drive.ply",
    "dish_with_olives.glb",
    "happy_buddha.ply",
    "lucy.ply",
    "mosquito_in_amber.ply",
    "sheen_chair.glb",
    "spot.glb",
    "teapot.ply",
)
CLOSED_MESHES = ("armadillo.ply", "lucy.ply", "boot.ply", "teapot.ply", "spot.glb")


@pytest.fixture
def real_mesh() -> Callable[[str], ldtrefl.Mesh]:
    """Loads a mesh of LDTREFL_MESH_PATH; the test is skipped where it is missing."""

    def load(name: str) -> ldtrefl.Mesh:
        for folder in filter(None, os.environ.get("LDTREFL_MESH_PATH", "").split(os.pathsep)):
            if (Path(folder) / name).is_file():
                return ldtrefl.load_mesh(Path(folder) / name)
        pytest.skip(f"{name} is not in LDTREFL_MESH_PATH")

    return load


@pytest.fixture
def mesh_or_shape(real_mesh: Callable[[str], ldtrefl.Mesh]) -> Callable[[str], ldtrefl.Mesh]:
    """A procedural shape by name, or a real mesh by file name."""
    return lambda name: real_mesh(name) if "." in name else shapes.make(name)


def rays_at(mesh: ldtrefl.Mesh, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) float32 origins on a sphere about the mesh, and unit directions towards points of its box."""
    rng = np.random.default_rng(seed)
    centre, half = mesh.unit_frame
    around = rng.normal(size=(count, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    origins = (centre + 2.5 * half * around).astype(np.float32)
    targets = rng.uniform(*mesh.bounds, size=(count, 3))
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return origins, directions.astype(np.float32)


@pytest.fixture(autouse=True)
def all_threads() -> None:
    """Every test starts with all threads."""
    ldtrefl.set_threads()
