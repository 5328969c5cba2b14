"""Every kind of rays against every mesh: time through the public calls and of kernels alone, and errors."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from timing import timed_in_turn

from .cores import ALL, threads
from .models import Model, model
from .rays import RAYS, Rays, kinds_of
from .rivals import Embreex, Rival
from .tracers import Caster, Exact, Fast, Linear, Ours, Peeled
from .truth import Truth, errors_of, truth, wrong_answers

OLD_KIND = "mirror, few hits"
"""The rays on which the paper's search and the fast quality are timed, too."""

MOST_FOR_ALL = 4_000_000
"""Triangles up to which every quality and search is timed."""

Tracers = dict[str, Any]


def rays_on_meshes(
    names: Sequence[str], rivals: Sequence[type[Rival]], rounds: int, rays: int = RAYS, kinds: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """A row per mesh; ``kinds`` are those wanted, all if empty."""
    rows = []
    for name in names:
        mesh = model(name)
        if mesh is None:
            print(f"{name}: not in LDTREFL_MESH_PATH, left out", file=sys.stderr)
            continue
        rows.append(rays_on_mesh(mesh, rivals, rounds, rays, kinds))
        print(_line(rows[-1]), flush=True)
    return rows


def rays_on_mesh(
    mesh: Model, rivals: Sequence[type[Rival]], rounds: int, rays: int = RAYS, kinds: Sequence[str] = ()
) -> dict[str, Any]:
    """One row of :func:`rays_on_meshes`."""
    tracers = _built(mesh, rivals)
    judge = tracers.get(Embreex.name) or tracers[Caster.name]
    measured = {}
    for batch in kinds_of(mesh, lambda o, d: judge.hits(Rays("", o, d)), rays):
        if not kinds or batch.kind in kinds:
            measured[batch.kind] = _measured(mesh, batch, tracers, rounds)
    return {"mesh": mesh.name, "triangles": len(mesh.faces), "kinds": measured}


def _built(mesh: Model, rivals: Sequence[type[Rival]]) -> Tracers:
    ours: list[type[Ours]] = [Peeled, Caster, Exact]
    if len(mesh.faces) <= MOST_FOR_ALL:
        ours += [Fast, Linear]
    theirs = [rival for rival in rivals if len(mesh.faces) <= rival.most_triangles]
    for kind in (*ours, *theirs):
        kind.set_threads(len(ALL))
    return {kind.name: kind(mesh.vertices, mesh.faces) for kind in (*ours, *theirs)}


def _measured(mesh: Model, batch: Rays, tracers: Tracers, rounds: int) -> dict[str, Any]:
    """Times and errors of everybody who takes these rays."""
    taking = {name: tracer for name, tracer in tracers.items() if isinstance(tracer, Ours) or tracer.takes(batch)}
    if batch.kind != OLD_KIND:
        taking = {name: tracer for name, tracer in taking.items() if name not in (Fast.name, Linear.name)}
    milliseconds = {}
    for count in sorted({1, len(ALL)}):
        with threads(count, taking.values()):
            milliseconds[str(count)] = _times(batch, taking, count, rounds)
    right = _right(mesh, batch, taking)
    return {
        "rays": len(batch.origins),
        "hits": int((right.triangle >= 0).sum()),
        "any_hit": batch.any_hit,
        "disputed": right.disputed,
        "unsure": int((~right.sure).sum()),
        "milliseconds": milliseconds,
        "errors": _errors(batch, taking, right),
    }


def _times(batch: Rays, taking: Tracers, count: int, rounds: int) -> dict[str, dict[str, Any]]:
    """Milliseconds by form of call ("numpy" or "kernel") and tracer, all in turn."""
    jobs: dict[tuple[str, str], Callable[[], Any]] = {}
    for name, tracer in taking.items():
        if count > 1 and (
            name in (Exact.name, Fast.name, Linear.name) or getattr(tracer, "has_threads", True) is False
        ):
            continue
        if calls_numpy(tracer, batch):
            jobs["numpy", name] = functools.partial(tracer.occluded if batch.any_hit else tracer.closest, batch)
        jobs["kernel", name] = tracer.prepared(batch)
    times = timed_in_turn({" ".join(key): job for key, job in jobs.items()}, rounds)
    found: dict[str, dict[str, Any]] = {"numpy": {}, "kernel": {}}
    for form, name in jobs:
        found[form][name] = times[f"{form} {name}"]
    return found


def calls_numpy(tracer: Any, batch: Rays) -> bool:
    """Whether it is a public call on arrays that is worth timing."""
    if isinstance(tracer, Ours):
        return tracer.name in (Peeled.name, Caster.name) and (tracer.has_occluded or not batch.any_hit)
    return tracer.takes_arrays


def _right(mesh: Model, batch: Rays, taking: Tracers) -> Truth:
    """The truth of these rays as closest hits."""
    rivals = [name for name, tracer in taking.items() if isinstance(tracer, Rival) and tracer.takes_arrays]
    answers = {name: taking[name].hits(batch) for name in (Caster.name, Exact.name, *rivals)}
    return truth(mesh, batch, answers, {Peeled.name: taking[Peeled.name].hits(batch)})


def _errors(batch: Rays, taking: Tracers, right: Truth) -> dict[str, dict[str, float]]:
    found = {}
    for name, tracer in taking.items():
        if isinstance(tracer, Rival) and not tracer.takes_arrays:
            continue
        if not batch.any_hit:
            found[name] = errors_of(tracer.hits(batch), right)
            continue
        blocked = tracer.occluded(batch) if isinstance(tracer, Rival) else _any_hits(tracer, batch)
        found[name] = wrong_answers(blocked & right.sure, (right.triangle >= 0) & right.sure)
    return found


def _any_hits(tracer: Ours, batch: Rays) -> np.ndarray:
    if tracer.has_occluded:
        return np.asarray(tracer.occluded(batch))
    kernel = tracer.prepared(batch)
    kernel()
    return kernel.occluded.numpy()


def _line(row: dict[str, Any]) -> str:
    """The mesh and million rays a second of ours and embreex's kernels, one thread, by kind."""
    parts = []
    for kind, entry in row["kinds"].items():
        times = entry["milliseconds"]["1"]["kernel"]
        rates = (entry["rays"] / 1000 / times[name]["median"] for name in (Peeled.name, Embreex.name) if name in times)
        parts.append(f"{kind} {' / '.join(f'{rate:.1f}' for rate in rates)}")
    return f"{row['mesh']:26s} {row['triangles']:9d}  " + "; ".join(parts)
