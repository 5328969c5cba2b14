"""What it takes to build: time on one thread and on all, and bytes where the structure tells."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Sequence
from typing import Any

from timing import timed_in_turn

import ldtrefl
from ldtrefl import launch
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.ldt import peel_mesh
from ldtrefl.raycast import Raycaster

from .cores import ALL, threads
from .models import Model, model
from .rivals import MitsubaScalar, Rival
from .tracers import Caster, Ours, Peeled
from .tracing import MOST_FOR_ALL

LARGE = 1_000_000
"""Triangles above which one round must do."""


def builds_of_meshes(names: Sequence[str], rivals: Sequence[type[Rival]], rounds: int) -> list[dict[str, Any]]:
    """A row per mesh."""
    rows = []
    for name in names:
        mesh = model(name)
        if mesh is None:
            print(f"{name}: not in LDTREFL_MESH_PATH, left out", file=sys.stderr)
            continue
        rows.append(builds_of_mesh(mesh, rivals, rounds))
        print(_line(rows[-1]), flush=True)
    return rows


def builds_of_mesh(mesh: Model, rivals: Sequence[type[Rival]], rounds: int) -> dict[str, Any]:
    """One row of :func:`builds_of_meshes`: "numpy" from arrays, "kernel" for a mesh that is on the device already."""
    rounds = 1 if len(mesh.faces) > LARGE else max(2, rounds // 2)
    theirs = [rival for rival in rivals if len(mesh.faces) <= rival.most_triangles and rival is not MitsubaScalar]
    public = {kind.name: functools.partial(kind, mesh.vertices, mesh.faces) for kind in (Peeled, Caster, *theirs)}
    geometry = DeviceMesh(ldtrefl.Mesh(mesh.vertices, mesh.faces), launch.resolve_device(None))
    kernels: dict[str, Callable[[], Any]] = {
        "ldt": functools.partial(peel_mesh, geometry),
        "bvh": functools.partial(Raycaster.of, geometry),
        "ldt exact": functools.partial(peel_mesh, geometry, quality="exact"),
    }
    if len(mesh.faces) <= MOST_FOR_ALL:
        kernels["ldt fast"] = functools.partial(peel_mesh, geometry, quality="fast")
        kernels["ldt linear"] = functools.partial(peel_mesh, geometry, search="linear")
    jobs = {("numpy", name): job for name, job in public.items()}
    jobs |= {("kernel", name): job for name, job in kernels.items()}
    found: dict[str, Any] = {}
    for count in sorted({1, len(ALL)}):
        with threads(count, (Ours, *theirs)):
            times = timed_in_turn({" ".join(key): job for key, job in jobs.items()}, rounds)
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


def _line(row: dict[str, Any]) -> str:
    parts = []
    for count, forms in row["milliseconds"].items():
        times = ", ".join(f"{name} {entry['median']:.1f}" for name, entry in forms["numpy"].items())
        parts.append(f"{count} thread{'s' if count != '1' else ''}: {times}")
    return f"{row['mesh']:26s} {row['triangles']:9d}  build, ms, " + "; ".join(parts)
