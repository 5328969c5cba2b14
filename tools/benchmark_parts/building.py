"""What it takes to build: time on one thread and on all, and bytes where the structure tells."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

from timing import timed_in_turn

import ldtrefl
from ldtrefl import launch
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.ldt import peel_mesh
from ldtrefl.raycast import Raycaster

from .cores import ALL, threads
from .models import Model
from .ours import Caster, Fast, Ours, Peeled
from .ray_tracer import RayTracer
from .rivals import MitsubaScalar, Rival

MOST_SECONDS = 6.0
"""For the rounds of one mesh, on one number of threads: large ones are built once or twice by each."""


def builds_of_mesh(mesh: Model, rivals: Sequence[type[Rival]], rounds: int) -> dict[str, Any]:
    """Milliseconds and bytes: "numpy" from arrays, "kernel" for a mesh that is on the device already."""
    theirs = [rival for rival in rivals if len(mesh.faces) <= rival.most_triangles and rival is not MitsubaScalar]
    everybody: tuple[type[RayTracer], ...] = (Peeled, Caster, *theirs)
    public = {kind.name: functools.partial(kind, mesh.vertices, mesh.faces) for kind in everybody}
    geometry = DeviceMesh(ldtrefl.Mesh(mesh.vertices, mesh.faces), launch.resolve_device(None))
    kernels: dict[str, Callable[[], Any]] = {
        "ldt": functools.partial(peel_mesh, geometry),
        "bvh": functools.partial(Raycaster.of, geometry),
        "ldt exact": functools.partial(peel_mesh, geometry, quality="exact"),
    }
    if len(mesh.faces) <= Fast.most_triangles:
        kernels["ldt fast"] = functools.partial(peel_mesh, geometry, quality="fast")
        kernels["ldt linear"] = functools.partial(peel_mesh, geometry, search="linear")
    jobs: dict[tuple[str, str], Callable[[], Any]] = {("numpy", name): job for name, job in public.items()}
    jobs |= {("kernel", name): job for name, job in kernels.items()}
    found: dict[str, Any] = {}
    for count in sorted({1, len(ALL)}):
        with threads(count, (Ours, *theirs)):
            times = timed_in_turn({" ".join(key): job for key, job in jobs.items()}, rounds, MOST_SECONDS)
        found[str(count)] = {
            form: {n: times[f"{form} {n}"] for f, n in jobs if f == form} for form in ("numpy", "kernel")
        }
    bytes_of = {name: job().nbytes for name, job in kernels.items() if name != "bvh"}
    return {
        "mesh": mesh.name,
        "triangles": len(mesh.faces),
        "mesh_bytes": mesh.vertices.nbytes + mesh.faces.nbytes,
        "milliseconds": found,
        "bytes": bytes_of,
    }


def build_line(row: dict[str, Any]) -> str:
    parts = []
    for count, forms in row["milliseconds"].items():
        times = ", ".join(f"{name} {entry['median']:.1f}" for name, entry in forms["numpy"].items())
        parts.append(f"{count} thread{'s' if count != '1' else ''}: {times}")
    return f"{row['mesh']:26s} {row['triangles']:9d}  build, ms, " + "; ".join(parts)
