"""Memory that building takes: what stays, and the most there was meanwhile, each builder in a process of its own.

The process has the mesh as numpy arrays (float64 vertices and int32 faces for ours, as ``ldtrefl.Mesh`` holds them, and
float32 vertices for rivals) and has built a small mesh before, so that code and pools are not counted.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .growth import growth_in_own_process, growth_of
from .models import Model, load
from .ours import Caster, Exact, Ours, Peeled
from .ray_tracer import RayTracer
from .result import Memory, MemoryRow
from .rivals import RIVALS, Rival

MEMORY_MESHES = ("knot 10 k", "knot 96 k", "knot 2 M", "knot 10 M", "lucy.ply loop 2 rough")
"""The meshes of a full run."""

SMALL = "knot 1 k"
"""The mesh that a process builds first, so that code and pools are there."""

EVERYBODY: tuple[type[RayTracer], ...] = (Peeled, Exact, Caster, *(kind for kind in RIVALS if kind.is_default))


def memory_of_mesh(mesh: Model, tracers: Sequence[type[RayTracer]]) -> MemoryRow:
    """Bytes kept and at the peak, by builder."""
    names = [kind.name for kind in tracers if kind in EVERYBODY and len(mesh.faces) <= kind.most_triangles]
    builders: dict[str, Memory] = {}
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "vertices.npy", mesh.vertices.astype(np.float64))
        np.save(Path(folder) / "faces.npy", mesh.faces)
        for name in names:
            builders[name] = growth_in_own_process("memory", name, folder)
    own = 8 * mesh.vertices.size + mesh.faces.nbytes
    return {"mesh": mesh.name, "triangles": len(mesh.faces), "mesh_bytes": own, "builders": builders}


def memory_line(row: MemoryRow) -> str:
    """The peaks, times the mesh's own bytes."""
    peaks = ", ".join(f"{name} {entry['peak'] / row['mesh_bytes']:.2f}" for name, entry in row["builders"].items())
    return f"{row['mesh']:26s} {row['triangles']:9d}  peak memory while building, of the mesh's own bytes: {peaks}"


def _growth(name: str, folder: Path) -> Memory:
    """What this process grows by when it builds."""
    builder = next(kind for kind in EVERYBODY if kind.name == name)
    if issubclass(builder, Rival):
        builder.load()
    small = load(SMALL)
    assert small is not None
    as_taken = np.float64 if issubclass(builder, Ours) else np.float32
    vertices, faces = (np.load(folder / f"{kind}.npy") for kind in ("vertices", "faces"))
    vertices = vertices.astype(as_taken, copy=False)
    warm_up = builder(small.vertices.astype(as_taken), small.faces)
    del warm_up, small
    return growth_of(lambda: builder(vertices, faces))


if __name__ == "__main__":
    print(json.dumps(_growth(sys.argv[1], Path(sys.argv[2]))))
