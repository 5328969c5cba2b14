"""Error against time of every method, as a plot and in Markdown."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

from .method_runs import PROJECTIONS
from .result import ErrorPoint, Result
from .tables import table

LEAST_ERROR = 1e-7
"""What an error of 0 is drawn as, for the axis is logarithmic."""

MILLISECONDS = [step * 10**power for power in range(6) for step in (1, 2, 5)]
"""What the axis of times may be marked with."""

STYLES = {
    "bvh": ("black", "s"),
    "bvh, decimated": ("gray", "s"),
    "ldt balanced": ("tab:green", "o"),
    "ldt fast": ("limegreen", "o"),
    "ldt exact": ("darkgreen", "o"),
    "ldt linear": ("tab:olive", "o"),
    **{
        f"envmap {projection}": (color, "^")
        for projection, color in zip(
            PROJECTIONS, ("tab:pink", "tab:red", "tab:orange", "tab:brown", "tab:purple"), strict=True
        )
    },
    "planar": ("deepskyblue", "*"),
    "fermat": ("tab:blue", "D"),
    "fermat-uv": ("tab:cyan", "D"),
    "bisector": ("navy", "v"),
    "tessellation": ("mediumslateblue", "v"),
    "tessellation, decimated": ("plum", "v"),
}
"""Color and marker of each curve: families of methods have a marker each."""

LARGER = ("bvh", "bvh, decimated", "envmap infinite", "planar")
"""Curves with larger markers, for others lie upon them."""


def error_plot(points: list[ErrorPoint]) -> Figure:
    """Error against time, a panel for each scene; filled markers are the methods' usual parameters."""
    scenes = list(dict.fromkeys(point["scene"] for point in points))
    figure = Figure(figsize=(6.0 * len(scenes), 7.5), layout="constrained")
    panels = figure.subplots(1, len(scenes), sharey=True, squeeze=False)[0]
    for panel, scene in zip(panels, scenes, strict=True):
        _draw_panel(panel, [point for point in points if point["scene"] == scene])
        panel.set(title=scene.capitalize(), xlabel="milliseconds per frame")
    panels[0].set_ylabel(f"FLIP over the mirror ({LEAST_ERROR:g} = none)")
    named = {label: line for panel in panels for line, label in zip(*panel.get_legend_handles_labels(), strict=True)}
    curves = [curve for curve in STYLES if curve in named]
    lines, title = [named[curve] for curve in curves], "filled: usual parameters"
    figure.legend(lines, curves, loc="outside lower center", ncols=6, title=title)
    return figure


def _draw_panel(panel: Axes, points: list[ErrorPoint]) -> None:
    """The curves of one scene."""
    curves: dict[str, list[ErrorPoint]] = {}
    for point in points:
        curves.setdefault(point["curve"], []).append(point)
    for curve, along in curves.items():
        color, marker = STYLES[curve]
        times = [point["milliseconds"]["median"] for point in along]
        errors = [max(point["flip"], LEAST_ERROR) for point in along]
        usual = [i for i, point in enumerate(along) if point["is_usual"]]
        style: dict[str, Any] = {"color": color, "marker": marker, "markersize": 9 if curve in LARGER else 6}
        panel.plot(times, errors, fillstyle="none", linewidth=1.2, **style)
        panel.plot([times[i] for i in usual], [errors[i] for i in usual], linestyle="none", **style)
        panel.plot([], [], label=curve, linewidth=1.2, **style)
    panel.set(xscale="log", yscale="log")
    panel.xaxis.set_major_locator(FixedLocator(MILLISECONDS))
    panel.xaxis.set_major_formatter(StrMethodFormatter("{x:,g}"))
    panel.xaxis.set_minor_locator(NullLocator())
    panel.grid(True, alpha=0.3)


def error_tables(result: Result) -> list[str]:
    """Time, error and memory, a table for each scene."""
    points = result["error_against_time"]
    lines = ["## Error against time, every method", ""]
    lines += ["Error is over the mirror, beside `bvh` with the full mesh. The camera and all objects stay: maps, trees"]
    lines += ["and textures are made before. MB are what a process grows by when it makes a renderer and two frames by"]
    lines += ["the method's usual parameters, and the most meanwhile; the meshes that are uploaded and the images are"]
    lines += ["part of it.", ""]
    for scene in dict.fromkeys(point["scene"] for point in points):
        body = []
        for point in points:
            if point["scene"] == scene:
                figures = [f"{point['milliseconds']['median']:.1f}", f"{point['ssim']:.5f}", f"{point['flip']:.6f}"]
                body.append([point["curve"], point["label"], *figures, *_megabytes(point)])
        lines += [f"### {scene.capitalize()}", ""]
        lines += table(["method", "parameter", "ms", "SSIM", "FLIP", "MB", "MB, peak"], body)
    return lines


def _megabytes(point: ErrorPoint) -> list[str]:
    memory = point["memory"]
    return ["-", "-"] if memory is None else [f"{memory['kept'] / 1e6:.0f}", f"{memory['peak'] / 1e6:.0f}"]
