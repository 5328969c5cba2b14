"""Every kind of rays against every mesh: time through the public calls and of kernels alone, and errors."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

from timing import timed_in_turn

from .cores import ALL, threads
from .models import Model
from .ours import Caster, Exact, Fast, Linear, Peeled
from .ray_tracer import RayTracer
from .rays import RAYS, Rays, kinds_of
from .rivals import Embreex, Rival
from .truth import Truth, errors_of, truth, wrong_answers

OLD_KIND = "mirror, few hits"
"""The rays on which the paper's search and the fast quality are timed, too."""

MOST_SECONDS = 20.0
"""For one kind of rays, on one number of threads: what is hopelessly slow is timed in fewer rounds."""

Tracers = dict[str, RayTracer]


def rays_on_mesh(
    mesh: Model, rivals: Sequence[type[Rival]], rounds: int, rays: int = RAYS, kinds: Sequence[str] = ()
) -> dict[str, Any]:
    """Times and errors by kind of rays; ``kinds`` are those wanted, all if empty."""
    tracers = _built(mesh, rivals)
    judge = tracers.get(Embreex.name) or tracers[Caster.name]
    measured = {}
    for batch in kinds_of(mesh, lambda o, d: judge.hits(Rays("", o, d)), rays):
        if not kinds or batch.kind in kinds:
            measured[batch.kind] = _measured(mesh, batch, tracers, rounds)
    return {"mesh": mesh.name, "triangles": len(mesh.faces), "kinds": measured}


def _built(mesh: Model, rivals: Sequence[type[Rival]]) -> Tracers:
    everybody: tuple[type[RayTracer], ...] = (Peeled, Caster, Exact, Fast, Linear, *rivals)
    kinds = [kind for kind in everybody if len(mesh.faces) <= kind.most_triangles]
    for kind in kinds:
        kind.set_threads(len(ALL))
    return {kind.name: kind(mesh.vertices, mesh.faces) for kind in kinds}


def _measured(mesh: Model, batch: Rays, tracers: Tracers, rounds: int) -> dict[str, Any]:
    """Times and errors of everybody who takes these rays."""
    taking = {name: tracer for name, tracer in tracers.items() if tracer.takes(batch)}
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
        if count > 1 and (name in (Exact.name, Fast.name, Linear.name) or not tracer.has_threads):
            continue
        if tracer.takes_arrays(batch):
            jobs["numpy", name] = functools.partial(tracer.occluded if batch.any_hit else tracer.closest, batch)
        jobs["kernel", name] = tracer.prepared(batch)
    times = timed_in_turn({" ".join(key): job for key, job in jobs.items()}, rounds, MOST_SECONDS)
    found: dict[str, dict[str, Any]] = {"numpy": {}, "kernel": {}}
    for form, name in jobs:
        found[form][name] = times[f"{form} {name}"]
    return found


def _right(mesh: Model, batch: Rays, taking: Tracers) -> Truth:
    """The truth of these rays as closest hits."""
    exact = [name for name, tracer in taking.items() if isinstance(tracer, Rival) and tracer.takes_arrays(batch)]
    answers = {name: taking[name].hits(batch) for name in (Caster.name, Exact.name, *exact)}
    return truth(mesh, batch, answers, {Peeled.name: taking[Peeled.name].hits(batch)})


def _errors(batch: Rays, taking: Tracers, right: Truth) -> dict[str, dict[str, float]]:
    found = {}
    for name, tracer in taking.items():
        if isinstance(tracer, Rival) and not tracer.takes_arrays(batch):
            continue
        if batch.any_hit:
            found[name] = wrong_answers(tracer.occluded(batch) & right.sure, (right.triangle >= 0) & right.sure)
        else:
            found[name] = errors_of(tracer.hits(batch), right)
    return found


def rays_line(row: dict[str, Any]) -> str:
    """The mesh and million rays a second of ours and embreex's kernels, one thread, by kind."""
    parts = []
    for kind, entry in row["kinds"].items():
        times = entry["milliseconds"]["1"]["kernel"]
        rates = (entry["rays"] / 1000 / times[name]["median"] for name in (Peeled.name, Embreex.name) if name in times)
        parts.append(f"{kind} {' / '.join(f'{rate:.1f}' for rate in rates)}")
    return f"{row['mesh']:26s} {row['triangles']:9d}  " + "; ".join(parts)
