"""The result as plots and in Markdown."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from ldtrefl.files import written_whole

from .common import KNOTS

matplotlib.use("Agg")
from matplotlib import pyplot as plt


def draw_plots(result: dict[str, Any], folder: Path) -> None:
    """Error against time, and time against triangles."""
    figure, axes = plt.subplots(figsize=(7, 5))
    curves: dict[str, list[tuple[float, float]]] = {}
    for point in result["error_against_time"]:
        curves.setdefault(point["curve"], []).append((point["milliseconds"]["median"], point["flip"]))
    for curve, points in curves.items():
        times, errors = zip(*points, strict=True)
        axes.plot(times, np.maximum(errors, 1e-7), "o-", label=curve, markersize=4)
    axes.set(xscale="log", yscale="log", xlabel="milliseconds per frame", ylabel="FLIP over the mirror (1e-7 = none)")
    axes.set_title("Error against time: mirror ball and torus knot")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    _save(figure, folder / "error_against_time.png")

    knots = [row for row in result["meshes"] if row["mesh"] in KNOTS]

    def figure_of(entry: Any) -> float:
        return entry["median"] if isinstance(entry, dict) else entry / 1e6

    for key, label, name in (
        ("milliseconds", "milliseconds for the rays of a frame, one thread", "time_against_triangles.png"),
        ("build_milliseconds", "milliseconds to build, one thread", "build_against_triangles.png"),
        ("bytes", "megabytes beside the mesh", "bytes_against_triangles.png"),
    ):
        figure, axes = plt.subplots(figsize=(7, 5))
        for tracer in knots[0][key]:
            values = [figure_of(row[key][tracer]) for row in knots]
            axes.plot([row["triangles"] for row in knots], values, "o-", label=tracer, markersize=4)
        axes.set(xscale="log", yscale="log", xlabel="triangles", ylabel=label, title="Torus knot")
        axes.grid(True, which="both", alpha=0.3)
        axes.legend()
        _save(figure, folder / name)


def _save(figure: Any, path: Path) -> None:
    figure.tight_layout()
    with written_whole(path) as scratch:
        figure.savefig(scratch, dpi=110)
    plt.close(figure)


def reading(result: dict[str, Any]) -> str:
    """The figures as Markdown tables."""
    lines = [
        "# Benchmark",
        "",
        f"{result['machine']}; medians, milliseconds.",
        "",
        "## Rays of a frame, one thread",
        "",
    ]
    lines += ["| mesh | triangles | Warp BVH | Embree | exact | default | fast | linear | exact: wrong % | "]
    lines[-1] += (
        "default: wrong hits %, misses % | default: p99 texels | BVH / exact | BVH / default | Embree / default |"
    )
    lines += ["|" + "---|" * 14]
    for row in result["meshes"]:
        t = {name: entry["median"] for name, entry in row["milliseconds"].items()}
        exact, default = row["errors"]["ldt exact"], row["errors"]["ldt balanced"]
        wrong = exact["wrong_hits"] + exact["wrong_misses"]
        lines.append(
            f"| {row['mesh']} | {row['triangles']} | {t['bvh']:.1f} | {t['embree']:.1f} | {t['ldt exact']:.1f} | "
            f"{t['ldt balanced']:.1f} | {t['ldt fast']:.1f} | {t['ldt linear']:.0f} | {wrong:.4f} | "
            f"{default['wrong_hits']:.3f}, {default['wrong_misses']:.3f} | {default['p99']:.3f} | "
            f"{t['bvh'] / t['ldt exact']:.2f} | {t['bvh'] / t['ldt balanced']:.2f} | "
            f"{t['embree'] / t['ldt balanced']:.2f} |"
        )
    lines += ["", "## Build, one thread", "", "| mesh | Warp BVH | Embree | default | exact | linear | default MB | "]
    lines[-1] += "BVH, Embree MB | rays to break even with BVH |"
    lines += ["|" + "---|" * 9]
    for row in result["meshes"]:
        b = {name: entry["median"] for name, entry in row["build_milliseconds"].items()}
        t = {name: entry["median"] / row["rays"] for name, entry in row["milliseconds"].items()}
        later, gain = b["ldt balanced"] - b["bvh"], t["bvh"] - t["ldt balanced"]
        even = "0" if later <= 0 else f"{later / gain:.0f}" if gain > 0 else "never"
        lines.append(
            f"| {row['mesh']} | {b['bvh']:.1f} | {b['embree']:.1f} | {b['ldt balanced']:.1f} | {b['ldt exact']:.1f} | "
            f"{b['ldt linear']:.1f} | {row['bytes']['ldt balanced'] / 1e6:.1f} | {row['bytes']['bvh'] / 1e6:.0f}, "
            f"{row['bytes']['embree'] / 1e6:.0f} | {even} |"
        )
    lines += ["", "## A frame, by stage", ""]
    for name, stages in result["stages"].items():
        lines.append(f"- {name}: " + ", ".join(f"{stage} {value:.1f}" for stage, value in stages.items()))
    lines += ["", "## What `error` asks for and what comes of it", ""]
    lines += [
        "| scene | search | error, pixels | p50 | p99 | MB | peel, ms | march, ms |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in result["error_targets"]:
        figures = ("-" if row[key] is None else f"{row[key]:.3f}" for key in ("pixels_p50", "pixels_p99"))
        lines.append(
            f"| {row['scene']} | {row['search']} | {row['error'] or 'usual 256'} | {' | '.join(figures)} | "
            f"{row['bytes'] / 1e6:.2f} | {row['peel']:.1f} | {row['march']:.1f} |"
        )
    scaling = ", ".join(f"{name} {value:.2f}" for name, value in result["scaling"].items())
    lines += ["", f"One thread over two: {scaling}.", "", "## The paper's tables", ""]
    lines += ["| model | paper: layers, ms (GeForce 7800) | ours | layers, ms (this CPU) |", "|---|---|---|---|"]
    for model, entry in result["paper"]["table_1"].items():
        paper, ours = entry["paper"], entry["ours"]
        lines.append(
            f"| {model}, {paper['triangles']} | {paper['layers']}, {paper['milliseconds']:.1f} | {ours['model']}, "
            f"{ours['triangles']} | {ours['layers']}, {ours['milliseconds']:.1f} |"
        )
    lines += ["", "| scene | paper: reflector + reflection ms | ours: linear | exact |", "|---|---|---|---|"]
    for name, entry in result["paper"]["table_2"].items():
        paper, ours = entry["paper"], entry["ours"]
        total = paper["reflector"] + paper["reflection"]
        lines.append(f"| {name} | {total:.1f} | {ours['linear']:.1f} | {ours['exact']:.1f} |")
    lines += ["", "## Error against time", "", "| method | parameter | ms | SSIM | FLIP |", "|---|---|---|---|---|"]
    for point in result["error_against_time"]:
        lines.append(
            f"| {point['curve']} | {point['label']} | {point['milliseconds']['median']:.1f} | {point['ssim']:.5f} | "
            f"{point['flip']:.6f} |"
        )
    return "\n".join(lines) + "\n"
