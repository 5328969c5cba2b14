"""The result as plots and in Markdown."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import matplotlib
from timing import Summary

from ldtrefl.files.atomic_write import written_whole

from .error_report import error_plot, error_tables
from .frame_tables import frames_before_tables, rival_frames_tables, start_table
from .models import KNOTS
from .paper import TABLE_1_COLUMNS, TABLE_2_COLUMNS, table_1_rows, table_2_rows
from .result import Result
from .tables import build_tables, memory_table, number, rays_tables, table
from .tracing import OLD_KIND

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.figure import Figure


def draw_plots(result: Result, folder: Path) -> None:
    """Error against time, and time, build time and bytes against triangles, of the parts that were run."""
    threads = str(result["threads"][0])
    if "error_against_time" in result:
        _save(error_plot(result["error_against_time"]), folder / "error_against_time.png")
    if "rays" in result:
        knots = {row["triangles"]: row["kinds"] for row in result["rays"] if row["mesh"] in KNOTS}
        times = {
            n: kinds[OLD_KIND]["milliseconds"][threads]["kernel"] for n, kinds in knots.items() if OLD_KIND in kinds
        }
        label = f"milliseconds for the rays of a frame, threads: {threads}"
        _plot_against_triangles(_medians(times), label, folder / "time_against_triangles.png")
    if "build" in result:
        rows = [row for row in result["build"] if row["mesh"] in KNOTS]
        times = {row["triangles"]: row["milliseconds"][threads]["numpy"] for row in rows}
        label = f"milliseconds to build from numpy arrays, threads: {threads}"
        _plot_against_triangles(_medians(times), label, folder / "build_against_triangles.png")
        megabytes = {row["triangles"]: {n: b / 1e6 for n, b in row["bytes"].items()} for row in rows}
        _plot_against_triangles(megabytes, "megabytes beside the mesh", folder / "bytes_against_triangles.png")


def _medians(times: dict[int, dict[str, Summary]]) -> dict[int, dict[str, float]]:
    return {n: {name: entry["median"] for name, entry in by_tracer.items()} for n, by_tracer in times.items()}


def _plot_against_triangles(values: dict[int, dict[str, float]], label: str, path: Path) -> None:
    """A curve for each tracer: {triangles: {tracer: value}}."""
    figure, axes = plt.subplots(figsize=(7, 5), layout="tight")
    for tracer in dict.fromkeys(name for by_tracer in values.values() for name in by_tracer):
        known = [(n, by_tracer[tracer]) for n, by_tracer in sorted(values.items()) if tracer in by_tracer]
        axes.plot(*zip(*known, strict=True), "o-", label=tracer, markersize=4)
    axes.set(xscale="log", yscale="log", xlabel="triangles", ylabel=label, title="Torus knot")
    axes.grid(True, which="both", alpha=0.3)
    if values:
        axes.legend()
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    with written_whole(path) as scratch:
        figure.savefig(scratch, dpi=110)
    plt.close(figure)


def of_fastest(result: Result) -> Result:
    """The same figures with the fastest round of each timing in the place of the median."""
    return cast(Result, _of_fastest(result))


def _of_fastest(value: object) -> object:
    if isinstance(value, dict):
        replaced = {"median": value["min"]} if {"median", "min"} <= set(value) else {}
        return {key: _of_fastest(entry) for key, entry in value.items()} | replaced
    return [_of_fastest(entry) for entry in value] if isinstance(value, list) else value


def reading(result: Result) -> str:
    """The figures of the parts that were run, as Markdown tables."""
    lines = ["# Benchmark", "", f"{result['machine']}; {result['statistic']} of things timed in turn.", ""]
    if result["notes"]:
        lines += [*(f"- {note}" for note in result["notes"]), ""]
    for part, tables in (
        ("rays", rays_tables),
        ("build", build_tables),
        ("memory", memory_table),
        ("stages", _frame_tables),
        ("error_against_time", error_tables),
        ("rival_frames", rival_frames_tables),
        ("frames_before", frames_before_tables),
        ("start", start_table),
        ("scaling", _scaling_line),
        ("paper", _paper_tables),
    ):
        if part in result:
            lines += tables(result)
    return "\n".join(lines).rstrip() + "\n"


def _frame_tables(result: Result) -> list[str]:
    lines = ["## A frame, by stage", ""]
    for name, stages in result["stages"].items():
        lines.append(f"- {name}: " + ", ".join(f"{stage} {value:.1f}" for stage, value in stages.items()))
    lines += ["", "## What `error` asks for and what comes of it", ""]
    body = []
    for row in result["error_targets"]:
        figures = [number(row[key], 3) for key in ("pixels_p50", "pixels_p99")]
        sizes = [f"{row['bytes'] / 1e6:.2f}", f"{row['peel']:.1f}", f"{row['march']:.1f}"]
        body.append([row["scene"], row["search"], str(row["error"] or "usual 256"), *figures, *sizes])
    lines += table(["scene", "search", "error, pixels", "p50", "p99", "MB", "peel, ms", "march, ms"], body)
    return lines


def _scaling_line(result: Result) -> list[str]:
    scaling = ", ".join(f"{name} {value:.2f}" for name, value in result["scaling"].items())
    return [f"One thread over two: {scaling}.", ""]


def _paper_tables(result: Result) -> list[str]:
    found = result["paper"]
    return [
        "## The paper's tables",
        "",
        *table(TABLE_1_COLUMNS, table_1_rows(found)),
        *table(TABLE_2_COLUMNS, table_2_rows(found)),
    ]
