"""Time with one thread over time with two."""

from __future__ import annotations

import functools
from collections.abc import Callable

import warp as wp
from timing import timed_in_turn

import ldtrefl
from ldtrefl.device import launch
from ldtrefl.ldt.peel import peel_mesh
from ldtrefl.ldt.searches import TRACERS
from ldtrefl.scene import shapes
from ldtrefl.world.device_mesh import DeviceMesh

from .common import Batch
from .models import KNOTS
from .rays import mirror_rays

ITEMS = 100_000
"""Of the arithmetic alone."""

STEPS = wp.constant(200)
"""Multiplications and additions of an item: so many that memory does not count."""


@launch.kernel
def spin(first: int, out: wp.array(dtype=float)):
    """One thread does a chain of multiplications and additions for one item, and writes where it ends."""
    i = first + wp.tid()
    x = float(i)
    for _ in range(STEPS):
        x = 1.0001 * x + 0.5
    out[i] = x


def thread_scaling(quick: bool, rounds: int) -> dict[str, float]:
    """Time with one thread over time with two, of peeling, of marching, and of arithmetic alone: the machine's own."""
    device = launch.resolve_device(None)
    knots = {"10 k": KNOTS["knot 10 k"]} if quick else {"500 k": KNOTS["knot 500 k"], "2 M": KNOTS["knot 2 M"]}
    meshes = {}
    for size, segments in knots.items():
        mesh = shapes.make("torus_knot", {"segments": list(segments)})
        meshes[size] = DeviceMesh(ldtrefl.Mesh(mesh.unit_vertices, mesh.faces), device)
    o, d = mirror_rays(768, 512)
    origins, directions = (wp.array(x, dtype=wp.vec3, device=device) for x in (o, d))
    spun = wp.empty(ITEMS, dtype=float, device=device)
    work: dict[str, Callable[[], object]] = {"arithmetic": lambda: launch.launch(spin, ITEMS, [spun], device)}
    for size, geometry in meshes.items():
        work[f"march {size}"] = Batch(TRACERS["exact"], peel_mesh(geometry).view(), origins, directions)
        work[f"peel {size}"] = functools.partial(peel_mesh, geometry)
        work[f"peel linear {size}"] = functools.partial(peel_mesh, geometry, search="linear")

    def with_threads(threads: int, job: Callable[[], object]) -> None:
        ldtrefl.set_threads(threads)
        job()

    jobs = {
        f"{name} {threads}": functools.partial(with_threads, threads, job)
        for threads in (1, 2)
        for name, job in work.items()
    }
    times = timed_in_turn(jobs, rounds)
    return {name: times[f"{name} 1"]["median"] / times[f"{name} 2"]["median"] for name in work}
