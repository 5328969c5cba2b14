"""Every kind of rays against every mesh: time through the public calls and of kernels alone, and errors."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from timing import Summary, timed_in_turn

from .cores import ALL
from .models import Model
from .ours import Caster, Exact, Fast, Linear, Ours, Peeled
from .ray_tracer import RayTracer
from .rays import RAYS, Rays, kinds_of
from .result import KindRow, RaysRow, Times
from .rivals import Embreex
from .truth import errors_of, truth, wrong_answers


@dataclass(frozen=True)
class Plan:
    """What of the rays is wanted."""

    threads: Sequence[int]
    rays: int = RAYS
    kinds: Sequence[str] = ()
    """All if empty."""


OLD_KIND = "mirror, few hits"
"""The rays on which the paper's search and the fast quality are timed, too."""

JUDGES = (Embreex.name, Caster.name, Exact.name, Peeled.name)
"""Whose hits the rays of later bounces start from: the first that is there."""

MOST_SECONDS = 5.0
"""For one kind of rays, on one number of threads: what is slow is timed in fewer rounds."""

Built = dict[str, RayTracer]


def rays_on_mesh(mesh: Model, tracers: Sequence[type[RayTracer]], rounds: int, plan: Plan) -> RaysRow:
    """Times and errors by kind of rays."""
    built = _built(mesh, tracers)
    judge = next(built[name] for name in JUDGES if name in built)
    measured = {}
    for batch in kinds_of(mesh, lambda o, d: judge.hits(Rays("", o, d)), plan.rays):
        if len(batch.origins) and (not plan.kinds or batch.kind in plan.kinds):
            measured[batch.kind] = _measured(mesh, batch, built, rounds, plan)
    return {"mesh": mesh.name, "triangles": len(mesh.faces), "kinds": measured}


def _built(mesh: Model, tracers: Sequence[type[RayTracer]]) -> Built:
    some = [tracer for tracer in tracers if len(mesh.faces) <= tracer.most_triangles]
    for tracer in some:
        tracer.set_threads(len(ALL))
    return {tracer.name: tracer(mesh.vertices, mesh.faces) for tracer in some}


def _measured(mesh: Model, batch: Rays, built: Built, rounds: int, plan: Plan) -> KindRow:
    """Times and errors of everybody who takes these rays."""
    taking = {name: tracer for name, tracer in built.items() if tracer.takes(batch)}
    if batch.kind != OLD_KIND:
        taking = {name: tracer for name, tracer in taking.items() if name not in (Fast.name, Linear.name)}
    milliseconds: Times = {}
    for count in plan.threads:
        for tracer in taking.values():
            tracer.set_threads(count)
        milliseconds[str(count)] = _times(batch, taking, count, rounds)
    telling = {
        name: tracer for name, tracer in taking.items() if isinstance(tracer, Ours) or tracer.takes_arrays(batch)
    }
    answers = {name: tracer.hits(batch) for name, tracer in telling.items()}
    right = truth(mesh, batch, list(answers.values()))
    if batch.any_hit:
        hit = (right.triangle >= 0) & right.sure
        errors = {name: wrong_answers(tracer.occluded(batch) & right.sure, hit) for name, tracer in telling.items()}
    else:
        errors = {name: errors_of(answer, right) for name, answer in answers.items()}
    return {
        "rays": len(batch.origins),
        "hits": int((right.triangle >= 0).sum()),
        "any_hit": batch.any_hit,
        "undecided": int((~right.sure).sum()),
        "milliseconds": milliseconds,
        "errors": errors,
    }


def _times(batch: Rays, taking: Built, count: int, rounds: int) -> dict[str, dict[str, Summary]]:
    """Milliseconds by form of call ("numpy" or "kernel") and tracer, all in turn."""
    jobs: dict[tuple[str, str], Callable[[], object]] = {}
    for name, tracer in taking.items():
        if count > 1 and (name in (Exact.name, Fast.name, Linear.name) or not tracer.has_threads):
            continue
        if tracer.takes_arrays(batch):
            jobs["numpy", name] = functools.partial(tracer.occluded if batch.any_hit else tracer.closest, batch)
        jobs["kernel", name] = tracer.prepared(batch)
    times = timed_in_turn({" ".join(key): job for key, job in jobs.items()}, rounds, MOST_SECONDS)
    found: dict[str, dict[str, Summary]] = {"numpy": {}, "kernel": {}}
    for form, name in jobs:
        found[form][name] = times[f"{form} {name}"]
    return found


def rays_line(row: RaysRow) -> str:
    """The mesh and million rays a second of ours and embreex's kernels, by kind."""
    parts = []
    for kind, entry in row["kinds"].items():
        times = next(iter(entry["milliseconds"].values()))["kernel"]
        rates = (entry["rays"] / 1000 / times[name]["median"] for name in (Peeled.name, Embreex.name) if name in times)
        parts.append(f"{kind} {' / '.join(f'{rate:.1f}' for rate in rates)}")
    return f"{row['mesh']:26s} {row['triangles']:9d}  " + "; ".join(parts)
