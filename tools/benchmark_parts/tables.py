"""The tables of rays and of building, in Markdown."""

from __future__ import annotations

from collections.abc import Mapping

from timing import Summary

from .ratios import (
    few_over_many,
    larger_over_smaller,
    rival_over_ours,
    slower_than_bvh,
    time_of,
    with_outlier_over_without,
)
from .result import RaysRow, Result
from .tracing import OLD_KIND

FORMS = {"numpy": "public calls, numpy in and numpy out", "kernel": "kernels alone"}


def table(columns: list[str], rows: list[list[str]]) -> list[str]:
    """A Markdown table."""
    return [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns), *(f"| {' | '.join(row)} |" for row in rows), ""]


def number(value: float | None, digits: int = 2) -> str:
    """A figure, or a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}f}"


def rays_tables(result: Result) -> list[str]:
    """Summary, rates and errors."""
    rows, threads = result["rays"], [str(count) for count in result["threads"]]
    others = [name for name in result["tracers"] if not name.startswith("ldt")]
    lines = ["## Rivals over ours", ""]
    lines += ["Time of the other over time of `ldt`: of closest hits the median over kinds of rays (the least), of"]
    lines += ["any-hit rays the least. Above 1, `ldt` is faster.", ""]
    for count in threads:
        lines += [f"Threads: {count}.", "", *_ratio_table(rows, others, count)]
    lines += _scaling_table(rows, result["tracers"], threads)
    lines += _larger_and_outliers(rows, ["ldt", *others], threads[0])
    if {"ldt", "bvh"} <= set(result["tracers"]):
        slower = slower_than_bvh(rows, threads)
        lines += [f"Rows where `bvh` is faster than `ldt`: {len(slower) or 'none'}.", ""]
        lines += [*(f"- {row}" for row in slower), ""]
    for form, label in FORMS.items():
        for count in threads:
            lines += [f"## Million rays a second: {label}, threads: {count}", ""]
            lines += _rate_table(rows, form, count, result["tracers"])
    return [*lines, "## Errors", "", *_error_table(rows), *_old_table(rows, threads[0])]


def _ratio_table(rows: list[RaysRow], others: list[str], threads: str) -> list[str]:
    entries = rival_over_ours(rows, others, threads)
    shown = [other for other in others if any(other in entry["over"] for entry in entries)]
    body = []
    for entry in entries:
        cells = [entry["mesh"], str(entry["triangles"]), entry["form"]]
        for other in shown:
            over = entry["over"].get(other)
            if over is None:
                cells.append("-")
            else:
                cells.append(f"{number(over['closest'])} ({number(over['least'])}), any {number(over['any_hit'])}")
        body.append(cells)
    return table(["mesh", "triangles", "calls", *shown], body)


def _scaling_table(rows: list[RaysRow], tracers: list[str], threads: list[str]) -> list[str]:
    if len(threads) == 1:
        return []
    measured = [(row["mesh"], form, few_over_many(row, form, threads)) for row in rows for form in FORMS]
    shown = [tracer for tracer in tracers if any(tracer in ratios for _, _, ratios in measured)]
    body = [[mesh, form, *(number(ratios.get(t)) for t in shown)] for mesh, form, ratios in measured if ratios]
    lines = [f"Time with {threads[0]} thread over that with {threads[-1]}, median over kinds:", ""]
    return lines + table(["mesh", "calls", *shown], body)


def _larger_and_outliers(rows: list[RaysRow], tracers: list[str], threads: str) -> list[str]:
    lines = []
    larger = larger_over_smaller(rows, tracers, threads)
    if larger:
        kinds = list(dict.fromkeys(kind for by in larger.values() for ratios in by.values() for kind in ratios))
        lines += ["Time on the knot of 2 M triangles over that of 96 k:", ""]
        body = [
            [form, tracer, *(number(ratios.get(kind)) for kind in kinds)]
            for form, by in larger.items()
            for tracer, ratios in by.items()
        ]
        lines += table(["calls", "tracer", *kinds], body)
    outliers = with_outlier_over_without(rows, tracers, threads)
    if outliers:
        lines += ["Time with an outlier over that without, median (worst) over kinds:", ""]
        names = [tracer for tracer in tracers if any(entry["tracer"] == tracer for entry in outliers)]
        body = []
        for mesh, form in dict.fromkeys((entry["mesh"], entry["form"]) for entry in outliers):
            found = {e["tracer"]: e for e in outliers if (e["mesh"], e["form"]) == (mesh, form)}
            cells = [
                f"{number(found[n]['median'])} ({number(found[n]['worst'])})" if n in found else "-" for n in names
            ]
            body.append([mesh, form, *cells])
        lines += table(["mesh", "calls", *names], body)
    return lines


def _rate_table(rows: list[RaysRow], form: str, threads: str, tracers: list[str]) -> list[str]:
    body = []
    shown = [t for t in tracers if any(time_of(e, form, t, threads) for row in rows for e in row["kinds"].values())]
    for row in rows:
        for kind, entry in row["kinds"].items():
            rates = []
            for tracer in shown:
                time = time_of(entry, form, tracer, threads)
                rates.append(number(None if time is None else entry["rays"] / 1000 / time))
            hits = f"{100 * entry['hits'] / max(entry['rays'], 1):.0f}"
            body.append([row["mesh"], kind, str(entry["rays"]), hits, *rates])
    return table(["mesh", "rays", "number", "hits, %", *shown], body)


def _error_table(rows: list[RaysRow]) -> list[str]:
    lines = [
        "Wrong hits and misses in percent of true hits, distances in texels of a 128 map, same triangle in percent of"
    ]
    lines += [
        "common hits. Undecided rays pass within 1e-7 of the mesh's size of an edge and are judged by nobody.",
        "",
    ]
    body = []
    for row in rows:
        for kind, entry in row["kinds"].items():
            cells = [row["mesh"], kind, str(entry["undecided"])]
            for tracer in ("bvh", "embreex", "ldt exact", "ldt"):
                wrong = entry["errors"].get(tracer)
                cells.append("-" if wrong is None else f"{wrong['wrong_hits']:.4f}, {wrong['wrong_misses']:.4f}")
            for tracer in ("ldt exact", "ldt"):
                wrong = entry["errors"].get(tracer, {})
                figures = wrong.get("p99"), wrong.get("p999"), wrong.get("same_triangle")
                cells.append(", ".join(number(figure, 3) for figure in figures))
            body.append(cells)
    columns = ["mesh", "rays", "undecided", "bvh: wrong hits, misses", "embreex", "ldt exact", "ldt"]
    return lines + table([*columns, "ldt exact: p99, p99.9, same", "ldt: p99, p99.9, same"], body)


def _old_table(rows: list[RaysRow], threads: str) -> list[str]:
    """Milliseconds of the rays that a frame's mirror ball sends, in the order of earlier reports."""
    tracers = ["bvh", "embreex", "ldt exact", "ldt", "ldt fast", "ldt linear"]
    body = []
    for row in rows:
        entry = row["kinds"].get(OLD_KIND)
        if entry is None:
            continue
        times = [time_of(entry, "kernel", tracer, threads) for tracer in tracers]
        bvh, embree, exact, default = times[:4]
        ratios = [
            bvh and exact and bvh / exact,
            bvh and default and bvh / default,
            embree and default and embree / default,
        ]
        body.append([row["mesh"], str(row["triangles"]), *(number(x) for x in (*times, *ratios))])
    if not body:
        return []
    columns = ["mesh", "triangles", *tracers, "bvh / exact", "bvh / ldt", "embreex / ldt"]
    return [
        f"## Milliseconds for the rays of a frame ({OLD_KIND}), kernels, threads: {threads}",
        "",
        *table(columns, body),
    ]


def build_tables(result: Result) -> list[str]:
    """Milliseconds to build, and bytes."""
    rows = result["build"]
    lines = []
    for form, label in (("numpy", "from numpy arrays"), ("kernel", "of a mesh on the device already")):
        for count in map(str, result["threads"]):
            names = list(dict.fromkeys(n for row in rows for n in row["milliseconds"][count][form]))
            body = []
            for row in rows:
                times = row["milliseconds"][count][form]
                few = row["milliseconds"][str(result["threads"][0])][form]
                cells = [number(times[n]["median"] if n in times else None, 1) for n in names]
                cells.append(number(_quotient(times, "bvh", times, "ldt")))
                cells.append(number(_quotient(few, "ldt", times, "ldt")))
                body.append([row["mesh"], str(row["triangles"]), *cells])
            lines += [f"## Build, milliseconds, {label}, threads: {count}", ""]
            lines += table(
                ["mesh", "triangles", *names, "bvh / ldt", f"ldt: {result['threads'][0]} thread over these"], body
            )
    lines += ["## Bytes a triangle beside the mesh", ""]
    names = list(dict.fromkeys(name for row in rows for name in row["bytes"]))
    body = []
    for row in rows:
        each = [row["bytes"].get(name) for name in names]
        body.append([row["mesh"], *(number(None if b is None else b / row["triangles"], 1) for b in each)])
    return lines + table(["mesh", *names], body)


def _quotient(above: Mapping[str, Summary], upper: str, below: Mapping[str, Summary], lower: str) -> float | None:
    """One median over another, where both are known."""
    return above[upper]["median"] / below[lower]["median"] if upper in above and lower in below else None


def memory_table(result: Result) -> list[str]:
    """Megabytes, and times the mesh's own bytes."""
    body = []
    for row in result["memory"]:
        for builder, entry in row["builders"].items():
            own = row["mesh_bytes"]
            cells = [f"{entry[key] / 1e6:.0f} ({entry[key] / own:.2f})" for key in ("kept", "peak")]
            body.append([row["mesh"], str(row["triangles"]), f"{own / 1e6:.0f}", builder, *cells])
    lines = ["## Memory while building, megabytes (times the mesh's own bytes)", ""]
    lines += ["Growth of a process that has the mesh's arrays and has built a small mesh before; threads: all.", ""]
    return lines + table(["mesh", "triangles", "mesh's own MB", "builder", "kept", "peak"], body)
