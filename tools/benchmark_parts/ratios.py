"""Ratios of times: one tracer over another, many threads over one, with an outlier over without."""

from __future__ import annotations

import statistics
from typing import TypedDict

from .models import OUTLIER
from .result import KindRow, RaysRow

SMALLER, LARGER = "knot 96 k", "knot 2 M"
"""The two knots whose times are compared."""

FORMS = ("numpy", "kernel")
"""Forms of call: see ``result.Times``."""

ByTracer = dict[str, dict[str, dict[str, float]]]
"""Ratios by form of call, tracer and kind of rays."""


class Ratios(TypedDict):
    """A rival's time over ours, over all kinds of rays; None where no kind was measured."""

    closest: float | None
    """The median over kinds of closest hits."""
    least: float | None
    """The least of those."""
    any_hit: float | None
    """The least over kinds of any-hit rays."""


class RivalRow(TypedDict):
    """Rivals on one mesh by one form of call."""

    mesh: str
    triangles: int
    form: str
    over: dict[str, Ratios]
    """By rival."""


class OutlierRow(TypedDict):
    """A tracer's time on a mesh with an outlier over its time without, over kinds of rays."""

    mesh: str
    form: str
    tracer: str
    median: float
    worst: float


def time_of(entry: KindRow, form: str, tracer: str, threads: str) -> float | None:
    """Median milliseconds of a kind of rays, None where it was not measured."""
    found = entry["milliseconds"].get(threads, {}).get(form, {}).get(tracer)
    return None if found is None else found["median"]


def over_kinds(row: RaysRow, form: str, tracer: str, threads: str, *, any_hit: bool) -> list[float]:
    """The tracer's time over ours, a figure per kind of rays."""
    ratios = []
    for entry in row["kinds"].values():
        if entry["any_hit"] != any_hit:
            continue
        theirs, ours = time_of(entry, form, tracer, threads), time_of(entry, form, "ldt", threads)
        if theirs and ours:
            ratios.append(theirs / ours)
    return ratios


def rival_over_ours(rows: list[RaysRow], rivals: list[str], threads: str) -> list[RivalRow]:
    """Per mesh, form of call and rival: median and least over kinds of closest hits, and the least of any hit."""
    found = []
    for row in rows:
        for form in FORMS:
            entry: RivalRow = {"mesh": row["mesh"], "triangles": row["triangles"], "form": form, "over": {}}
            for rival in rivals:
                closest = over_kinds(row, form, rival, threads, any_hit=False)
                any_hit = over_kinds(row, form, rival, threads, any_hit=True)
                if closest or any_hit:
                    entry["over"][rival] = {
                        "closest": statistics.median(closest) if closest else None,
                        "least": min(closest) if closest else None,
                        "any_hit": min(any_hit) if any_hit else None,
                    }
            if entry["over"]:
                found.append(entry)
    return found


def few_over_many(row: RaysRow, form: str, threads: list[str]) -> dict[str, float]:
    """Per tracer, its time with the fewest threads over that with the most, median over kinds."""
    ratios: dict[str, list[float]] = {}
    for entry in row["kinds"].values():
        many_threads = entry["milliseconds"].get(threads[-1], {}) if len(threads) > 1 else {}
        for tracer in many_threads.get(form, ()):
            few, many = time_of(entry, form, tracer, threads[0]), time_of(entry, form, tracer, threads[-1])
            if few and many:
                ratios.setdefault(tracer, []).append(few / many)
    return {tracer: statistics.median(values) for tracer, values in ratios.items()}


def larger_over_smaller(rows: list[RaysRow], tracers: list[str], threads: str) -> ByTracer:
    """Per form, tracer and kind: time on the larger knot over time on the smaller, for as many rays."""
    by_name = {row["mesh"]: row["kinds"] for row in rows}
    found: ByTracer = {}
    if SMALLER not in by_name or LARGER not in by_name:
        return found
    for form in FORMS:
        for tracer in tracers:
            ratios = {}
            for kind, larger in by_name[LARGER].items():
                smaller = by_name[SMALLER].get(kind)
                pair = (time_of(larger, form, tracer, threads), smaller and time_of(smaller, form, tracer, threads))
                if smaller and pair[0] and pair[1]:
                    ratios[kind] = (pair[0] / larger["rays"]) / (pair[1] / smaller["rays"])
            if ratios:
                found.setdefault(form, {})[tracer] = ratios
    return found


def with_outlier_over_without(rows: list[RaysRow], tracers: list[str], threads: str) -> list[OutlierRow]:
    """Per mesh with an outlier, form and tracer: the median and the worst over kinds of its time over that without."""
    by_name = {row["mesh"]: row["kinds"] for row in rows}
    found = []
    for name, kinds in by_name.items():
        parts = OUTLIER.fullmatch(name)
        if parts is None or parts["base"] not in by_name:
            continue
        for form in FORMS:
            for tracer in tracers:
                ratios = []
                for kind, entry in kinds.items():
                    base = by_name[parts["base"]].get(kind)
                    pair = (time_of(entry, form, tracer, threads), base and time_of(base, form, tracer, threads))
                    if base and pair[0] and pair[1]:
                        ratios.append((pair[0] / entry["rays"]) / (pair[1] / base["rays"]))
                if ratios:
                    median, worst = statistics.median(ratios), max(ratios)
                    found.append(OutlierRow(mesh=name, form=form, tracer=tracer, median=median, worst=worst))
    return found


def slower_than_bvh(rows: list[RaysRow], threads: list[str]) -> list[str]:
    """Where our BVH is faster than the maps: mesh, kind, form, threads and by how much."""
    found = []
    for row in rows:
        for kind, entry in row["kinds"].items():
            for form in FORMS:
                for count in threads:
                    ours, bvh = time_of(entry, form, "ldt", count), time_of(entry, form, "bvh", count)
                    if ours and bvh and ours > bvh:
                        found.append(f"{row['mesh']}, {kind}, {form}, threads: {count}: {ours / bvh:.2f} x")
    return found
