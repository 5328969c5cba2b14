"""The tables of whole frames and of starts, in Markdown."""

from __future__ import annotations

from mitsuba_parts.mitsuba_frames import LitFrames, PathFrames, ScalarPathFrames
from timing import Summary

from .our_frames import METHODS
from .result import FrameRow, Result, StartRow
from .rival_frames import ON_SMALL_KNOT
from .tables import number, table

WORK = """\
Every frame is made in turn with those of the others, its camera moved a little, from the camera's place to numpy's
picture, two threads each; in its turn each makes two, of which the second counts. Meshes are made, scenes loaded and
kernels compiled before. One ray goes through the middle of each pixel, mirrors alone send rays on, at most as many
times as the table says, and light is scattered once. Times are the median (the least to the greatest) in milliseconds.

- *Mitsuba llvm* does the same work: a loop over Mitsuba's own camera, intersections, mirrors and textures, one kernel
  of Dr.Jit's, in which light is added up as ours is, with shadow rays only in the scene that has shadows. *unlike*:
  pixels that differ from those of `bvh` by more than 0.02, in percent; they lie at edges. What differs: ours draws
  triangles where Mitsuba traces camera rays; Mitsuba's rays start farther above surfaces; ours bends normals that would
  send a ray below its triangle; ours ends rays that bring less than 1/512, of which there are none in these scenes;
  ours keeps what `Frame.hits` and the other pictures of a frame are made from; Mitsuba's textures are floats.
- *path* are Mitsuba's `path` integrator's, many rays at once (llvm) and one at a time (scalar). The same camera rays
  and mirrored rays are traced, but surfaces glow by their albedo in place of lights: it adds up no lights and traces no
  shadow rays, which is less than ours does. It looks up the environment in a picture, and splats samples into a film,
  which is more. What mirrors nothing is black to it, so that it neither samples lights nor scatters light again.
- Mitsuba compiles again for another camera: here the one that it has is moved.
"""

BEFORE = """\
Frames by this checkout and by another, in turn, each method of each in a process of its own with two threads, the
camera moved before every frame; in its turn each makes two, of which the second counts. Times are the median (the least
to the greatest) in milliseconds; stages are those of `ldt`.
"""

STAGES = """\
Median milliseconds of the stages; *first* is the first frame, with all that is built, loaded and compiled for it where
no row above has done that.
"""

COMPARED_STAGES = "gbuffer", "shade", "march"

RIVALS = {LitFrames.name: "llvm", PathFrames.name: "llvm path", ScalarPathFrames.name: "scalar path"}
"""Mitsuba's frames, and how ratios to them are called."""


def rival_frames_tables(result: Result) -> list[str]:
    """Ours beside Mitsuba's."""
    rows = result["rival_frames"]
    makers = [*METHODS, *(name for name in RIVALS if any(name in row["makers"] for row in rows))]
    ratios = {"ldt / bvh": "bvh", **{f"ldt / {short}": name for name, short in RIVALS.items() if name in makers}}
    columns = ["scene", "triangles", "bounces", *makers, *ratios, f"ldt / {ON_SMALL_KNOT}", "unlike, %"]
    body = []
    for row in rows:
        cells = [row["scene"], str(row["triangles"]), str(row["bounces"])]
        cells += [_time(row, maker) for maker in makers]
        cells += [number(_ratio(row, "ldt", other)) for other in (*ratios.values(), ON_SMALL_KNOT)]
        body.append([*cells, number(row["unlike"], 4)])
    lines = ["## Whole frames beside Mitsuba 3", "", *_sizes(rows), *WORK.splitlines(), ""]
    return [*lines, *table(columns, body), *_stages(rows)]


def frames_before_tables(result: Result) -> list[str]:
    """Ours beside those of another checkout."""
    rows = result["frames_before"]
    body = []
    for row in rows:
        cells = [row["scene"], str(row["triangles"])]
        cells += [_time(row, label) for method in METHODS for label in (method, f"{method} before")]
        cells += [number(_ratio(row, method, f"{method} before")) for method in METHODS]
        cells += [number(_stage_ratio(row, stage, "ldt", "ldt before")) for stage in COMPARED_STAGES]
        body.append([*cells, number(_ratio(row, "ldt", "bvh"))])
    columns = ["scene", "triangles", *(label for method in METHODS for label in (method, f"{method} before"))]
    columns += [*(f"{method} / before" for method in METHODS)]
    columns += [*(f"{stage} / before" for stage in COMPARED_STAGES), "ldt / bvh"]
    lines = ["## Whole frames before and after", "", *_sizes(rows), *BEFORE.splitlines(), ""]
    return [*lines, *table(columns, body), *_stages(rows)]


def start_table(result: Result) -> list[str]:
    """From process to picture."""
    rows: list[StartRow] = result["start"]
    labels = list(rows[0]["checkouts"])
    first, *others = labels
    body = []
    for row in rows:
        found = row["checkouts"]
        cells = [row["what"], *(_summary(found[label]) for label in labels)]
        body.append([*cells, *(number(found[first]["median"] / found[other]["median"]) for other in others)])
    lines = ["## `ldtrefl render` of the teapot, from process to picture, milliseconds", ""]
    return lines + table(["", *labels, *(f"{first} / {other}" for other in others)], body)


def _sizes(rows: list[FrameRow]) -> list[str]:
    sizes = dict.fromkeys(f"{row['size'][0]} x {row['size'][1]}" for row in rows)
    return [f"Pixels: {', '.join(sizes)}.", ""]


def _time(row: FrameRow, maker: str) -> str:
    return _summary(row["makers"][maker]["milliseconds"]) if maker in row["makers"] else "-"


def _summary(times: Summary) -> str:
    return f"{times['median']:.1f} ({times['min']:.1f} to {times['max']:.1f})"


def _ratio(row: FrameRow, upper: str, lower: str) -> float | None:
    """One median over another, where both are known."""
    makers = row["makers"]
    if upper not in makers or lower not in makers:
        return None
    return makers[upper]["milliseconds"]["median"] / makers[lower]["milliseconds"]["median"]


def _stage_ratio(row: FrameRow, stage: str, upper: str, lower: str) -> float | None:
    """The same for a stage."""
    above, below = (row["makers"][maker]["stages"].get(stage, 0.0) for maker in (upper, lower))
    return above / below if below > 0.0 else None


def _stages(rows: list[FrameRow]) -> list[str]:
    """The stages of all frames, and the first frames."""
    times = [entry for row in rows for entry in row["makers"].values()]
    stages = list(dict.fromkeys(stage for entry in times for stage in entry["stages"]))
    body = []
    for row in rows:
        for label, entry in row["makers"].items():
            known = [number(entry["stages"].get(stage), 1) for stage in stages]
            body.append([row["scene"], label, *known, number(entry["first"], 0)])
    lines = [
        "Median milliseconds of the stages, and of the first frame with all that is built, loaded and compiled for"
    ]
    return [*lines, "it, where that was not done by a row above.", "", *table(["scene", "by", *stages, "first"], body)]
