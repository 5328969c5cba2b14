"""What tests share: real meshes where they are, and a small scene."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import ldtrefl
from ldtrefl.files.map_cache import MapCache
from ldtrefl.methods import base
from ldtrefl.scene import shapes

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


SMALL_SCENE = """
[camera]
eye = [0.0, -5.0, 1.0]
look_at = [0.0, 0.0, 0.0]
width = 24
height = 16

[[object]]
shape = "sphere"
params = { segments = [16, 8] }
[object.material]
mirror = [0.9, 0.9, 0.9]

[[object]]
name = "thing"
shape = "torus"
params = { segments = [16, 8] }
translate = [1.5, -1.5, 0.0]
"""
"""A mirror ball and a torus, 24 x 16 pixels."""


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


USUAL_SAMPLES = base.DEFAULT_SAMPLES
"""Samples of a pixel where nothing is said."""


@pytest.fixture(autouse=True)
def one_sample() -> Iterator[None]:
    """Tests look at what the centres of pixels see, unless they ask for samples: closed forms are of points."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(base, "DEFAULT_SAMPLES", 1)
        yield


@pytest.fixture(autouse=True)
def usual_settings() -> Iterator[None]:
    """After every test all threads are used, the memory limit is the usual one, and no maps are kept."""
    yield
    ldtrefl.set_threads()
    ldtrefl.set_memory_limit()
    ldtrefl.keep_maps_in(None)


@pytest.fixture
def small_limit() -> None:
    """A memory limit of 1 MiB."""
    ldtrefl.set_memory_limit(1 << 20)


@pytest.fixture
def cache(tmp_path: Path) -> MapCache:
    """A folder that maps are kept in."""
    kept = MapCache(tmp_path / "maps")
    ldtrefl.keep_maps_in(kept)
    return kept
