"""What it takes to build: time on one thread and on all, and bytes where the structure tells."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

from timing import timed_in_turn

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.ldt.texture import LayeredDepthTexture
from ldtrefl.tracing.bvh import Raycaster
from ldtrefl.world.device_mesh import DeviceMesh

from .cores import one_core
from .models import Model
from .ours import Caster, Exact, Fast, Linear, Peeled
from .ray_tracer import RayTracer
from .result import BuildRow, Times

PEELERS: dict[str, Callable[[DeviceMesh], LayeredDepthTexture]] = {
    Peeled.name: peel_mesh,
    Exact.name: functools.partial(peel_mesh, quality="exact"),
    Fast.name: functools.partial(peel_mesh, quality="fast"),
    Linear.name: functools.partial(peel_mesh, search="linear"),
}
"""What peels a mesh that is on the device already, by name."""

MAKERS: dict[str, Callable[[DeviceMesh], LayeredDepthTexture | Raycaster]] = {
    Peeled.name: peel_mesh,
    Caster.name: Raycaster.of,
    **PEELERS,
}
"""What builds on a mesh that is on the device already, by name."""

MOST_SECONDS = 6.0
"""For the rounds of one mesh, on one number of threads: large ones are built once or twice by each."""


def builds_of_mesh(mesh: Model, tracers: Sequence[type[RayTracer]], rounds: int, counts: Sequence[int]) -> BuildRow:
    """Milliseconds and bytes: "numpy" from arrays, "kernel" for a mesh that is on the device already."""
    some = [kind for kind in tracers if len(mesh.faces) <= kind.most_triangles]
    geometry = DeviceMesh(ldtrefl.Mesh(mesh.vertices, mesh.faces), launch.resolve_device(None))
    makers = {
        name: functools.partial(make, geometry) for name, make in MAKERS.items() if name in [k.name for k in some]
    }
    found: Times = {}
    for count in counts:
        jobs: dict[tuple[str, str], Callable[[], object]] = {("kernel", name): make for name, make in makers.items()}
        for kind in some:
            kind.set_threads(count)
            if kind.is_default:
                build = _on_one_core if count == 1 and kind.builds_on_all else _build
                jobs["numpy", kind.name] = functools.partial(build, kind, mesh)
        times = timed_in_turn({" ".join(key): job for key, job in jobs.items()}, rounds, MOST_SECONDS)
        found[str(count)] = {
            form: {name: times[f"{form} {name}"] for f, name in jobs if f == form} for form in ("numpy", "kernel")
        }
    return {
        "mesh": mesh.name,
        "triangles": len(mesh.faces),
        "milliseconds": found,
        "bytes": {name: peel(geometry).nbytes for name, peel in PEELERS.items() if name in makers},
    }


def _build(kind: type[RayTracer], mesh: Model) -> RayTracer:
    return kind(mesh.vertices, mesh.faces)


def _on_one_core(kind: type[RayTracer], mesh: Model) -> RayTracer:
    with one_core():
        return _build(kind, mesh)


def build_line(row: BuildRow) -> str:
    """The mesh and the milliseconds of builds from numpy arrays, by number of threads."""
    parts = []
    for count, forms in row["milliseconds"].items():
        times = ", ".join(f"{name} {entry['median']:.1f}" for name, entry in forms["numpy"].items())
        parts.append(f"{count} thread{'s' if count != '1' else ''}: {times}")
    return f"{row['mesh']:26s} {row['triangles']:9d}  build, ms, " + "; ".join(parts)
