"""Run time against error: layered depth textures, Warp's BVH and other people's ray tracers on the same rays.

Everything is timed in turn in one process (A B A B ...), with compilation and a first round outside the clock; figures
are medians, with the fastest and slowest beside them in the JSON. Threads are stated with every figure; what cannot be
told to use one (embreex's builds) is kept to one core.

    python tools/benchmark.py            # 30 minutes; writes tools/results/benchmark.json, .md and plots
    python tools/benchmark.py --quick    # one minute, small meshes, for the shape of the output, on the screen
    python tools/benchmark.py --only rays,build --meshes "lucy.ply,knot 96 k" --kinds "primary;shadow"
                                         # a part of it: tables on the screen, files only where -o says

    python tools/benchmark.py --only rival-frames --scenes "teapot;ball, knot 10 M"
                                         # three seconds a scene and more; 10 M triangles are timed only if asked for
    python tools/benchmark.py --only methods               # every reflection method: error against time, memory
    python tools/benchmark.py --before ../other            # our frames and starts in turn with another checkout's

Parts: rays, build, memory, frames (stages, error targets), methods (every reflection method's error against time, and
its memory), rival-frames (whole frames beside Mitsuba's), start (process to picture), threads, paper. Real meshes are
taken from LDTREFL_MESH_PATH where they are; kinds of rays are described in ``benchmark_parts/rays.py``, names of meshes
in ``models.py``, rivals in ``rivals.py``, what is right in ``truth.py``, scenes of whole frames in ``frame_scenes.py``,
and methods with their parameters in ``method_runs.py``.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from pathlib import Path

import warp as wp
from benchmark_parts import cores
from benchmark_parts.building import build_line, builds_of_mesh
from benchmark_parts.common import ROOT
from benchmark_parts.frame_scenes import FRAME_SCENES
from benchmark_parts.frames import error_targets, frame_stages
from benchmark_parts.memory import MEMORY_MESHES, memory_line, memory_of_mesh
from benchmark_parts.method_errors import error_against_time
from benchmark_parts.models import OUTLIERS, every_name, model
from benchmark_parts.ours import OURS
from benchmark_parts.paper import paper_tables
from benchmark_parts.rays import KINDS, RAYS
from benchmark_parts.report import draw_plots, of_fastest, reading
from benchmark_parts.result import Result
from benchmark_parts.rival_frames import (
    QUICK_SCENES,
    QUICK_SIZE,
    USUAL_SCENES,
    frames_beside_before,
    frames_beside_mitsuba,
    frames_line,
    mitsuba_note,
)
from benchmark_parts.rivals import RIVALS, available
from benchmark_parts.starting import starts
from benchmark_parts.threads import thread_scaling
from benchmark_parts.tracing import Plan, rays_line, rays_on_mesh

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.files.atomic_write import written_whole

TRACERS = (*OURS, *RIVALS)
ALL_TRACERS = ", ".join(tracer.name for tracer in TRACERS)
PARTS = ("rays", "build", "memory", "frames", "methods", "rival-frames", "start", "threads", "paper")
PARTS_BEFORE = ("rival-frames", "start")
"""The parts that are measured beside another checkout."""
QUICK_MESHES = ("knot 1 k", "knot 10 k", "knot 10 k outlier 1e3")
QUICK_RAYS = 8000

OUTLIER_TRACERS = ("ldt", "bvh", "embreex")
"""The tracers that a full run times on meshes with outliers, on one thread: those meshes are many."""


def main() -> None:
    """Run the parts that are wanted and write JSON, Markdown and plots."""
    arguments = _arguments()
    result: Result = {}
    try:
        measure(arguments, result)
    except KeyboardInterrupt:
        if not result:
            raise
        result["notes"].append("Stopped before its end.")
    report = reading(of_fastest(result) if arguments.fastest else result)
    if arguments.output is None:
        print(report)
        return
    arguments.output.mkdir(parents=True, exist_ok=True)
    for name, text in (("benchmark.json", json.dumps(result, indent=1)), ("benchmark.md", report)):
        with written_whole(arguments.output / name) as scratch:
            scratch.write_text(text)
    draw_plots(result, arguments.output)
    print(f"written to {arguments.output}")


def _arguments() -> argparse.Namespace:
    def names(text: str) -> list[str]:
        return [name.strip() for name in text.split(",") if name.strip()]

    def kinds(text: str) -> list[str]:
        return [name.strip() for name in text.split(";") if name.strip()]

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small meshes, few rays and rounds")
    parser.add_argument("--only", type=names, help=f"parts, of {', '.join(PARTS)}")
    parser.add_argument("--meshes", type=names, default=[], help="of rays and build, by name, with commas between")
    parser.add_argument("--kinds", type=kinds, default=[], help="of rays, with semicolons between")
    parser.add_argument("--scenes", type=kinds, default=[], help="of rival-frames, with semicolons between")
    parser.add_argument("--before", type=Path, help="folder of another checkout, to compare frames and starts with")
    parser.add_argument("--tracers", type=names, default=[t.name for t in TRACERS], help="default: " + ALL_TRACERS)
    parser.add_argument("--threads", type=int, nargs="+", help="numbers of them; default: 1, and all cores")
    parser.add_argument("--rounds", type=int, help="that count, of each timing")
    parser.add_argument("--fastest", action="store_true", help="tables of fastest rounds: steadier on a busy machine")
    parser.add_argument("--rays", type=int, help="of each kind, about")
    parser.add_argument("-o", "--output", type=Path, help="folder to write to; default of a full run: tools/results")
    arguments = parser.parse_args()
    parts = PARTS if arguments.before is None else PARTS_BEFORE
    arguments.only = arguments.only or list(parts)
    for what, given, allowed in (
        ("part", arguments.only, parts),
        ("tracer", arguments.tracers, [tracer.name for tracer in TRACERS]),
        ("kind of rays", arguments.kinds, KINDS),
        ("scene", arguments.scenes, FRAME_SCENES),
    ):
        for name in given:
            if name not in allowed:
                parser.error(f"unknown {what} {name!r}, allowed are {'; '.join(allowed)}")
    chosen = arguments.meshes or arguments.kinds or arguments.threads or arguments.scenes
    is_whole = list(arguments.only) == list(PARTS) and not chosen
    is_whole = is_whole and len(arguments.tracers) == len(TRACERS) and not arguments.quick
    if arguments.output is None and is_whole:
        arguments.output = ROOT / "tools" / "results"
    return arguments


def measure(arguments: argparse.Namespace, result: Result) -> None:
    """The figures of the parts that are wanted, into ``result`` one by one: what is done when stopped is not lost."""
    quick, wanted = arguments.quick, arguments.only
    rivals, notes = available(arguments.tracers)
    tracers = [*(kind for kind in OURS if kind.name in arguments.tracers), *rivals]
    names = arguments.meshes or (list(QUICK_MESHES) if quick else every_name())
    rounds = arguments.rounds or (2 if quick else 5)
    frame_rounds = arguments.rounds or (2 if quick else 9)
    threads = sorted(set(arguments.threads or (1, len(cores.ALL))))
    plan = Plan(threads, arguments.rays or (QUICK_RAYS if quick else RAYS), arguments.kinds)
    result |= {
        "machine": f"{cores.processor()}, Warp {wp.__version__}",
        "threads": threads,
        "tracers": [tracer.name for tracer in tracers],
        "notes": notes,
        "statistic": "fastest rounds" if arguments.fastest else "medians",
        "quick": quick,
    }
    for note in notes:
        print(note, file=sys.stderr)
    for name in names if {"rays", "build", "memory"} & set(wanted) else ():
        mesh = model(name)
        if mesh is None:
            print(f"{name}: not in LDTREFL_MESH_PATH, left out", file=sys.stderr)
            continue
        if "rays" in wanted:
            is_brief = name in OUTLIERS and not arguments.meshes
            some = [tracer for tracer in tracers if not is_brief or tracer.name in OUTLIER_TRACERS]
            those = dataclasses.replace(plan, threads=threads[:1]) if is_brief else plan
            result.setdefault("rays", []).append(rays_on_mesh(mesh, some, rounds, those))
            print(rays_line(result["rays"][-1]), flush=True)
        if "build" in wanted:
            result.setdefault("build", []).append(builds_of_mesh(mesh, tracers, rounds, threads))
            print(build_line(result["build"][-1]), flush=True)
        if "memory" in wanted and (name in MEMORY_MESHES or arguments.meshes):
            result.setdefault("memory", []).append(memory_of_mesh(mesh, tracers))
            print(memory_line(result["memory"][-1]), flush=True)
    if "frames" in wanted:
        result |= {
            "stages": frame_stages(quick, frame_rounds),
            "error_targets": error_targets(quick, frame_rounds),
        }
    if "methods" in wanted:
        result["error_against_time"] = error_against_time(quick, frame_rounds)
    if "rival-frames" in wanted:
        _whole_frames(arguments, frame_rounds, result)
    if "start" in wanted:
        others = {} if arguments.before is None else {"before": arguments.before}
        result["start"] = starts({"now": ROOT, **others}, frame_rounds, quick)
    if "threads" in wanted:
        result["scaling"] = thread_scaling(quick, frame_rounds)
    if "paper" in wanted:
        result["paper"] = paper_tables(quick, frame_rounds)
    ldtrefl.set_threads()


def _whole_frames(arguments: argparse.Namespace, rounds: int, result: Result) -> None:
    """Whole frames, scene by scene, beside another checkout's or Mitsuba's."""
    size = QUICK_SIZE if arguments.quick else None
    note = None if arguments.before else mitsuba_note()
    if note:
        result["notes"].append(note)
        print(note, file=sys.stderr)
    for name in arguments.scenes or (QUICK_SCENES if arguments.quick else USUAL_SCENES):
        if arguments.before:
            row = frames_beside_before(name, size, rounds, arguments.before)
            result.setdefault("frames_before", []).append(row)
        else:
            row = frames_beside_mitsuba(name, size, rounds, with_mitsuba=note is None)
            result.setdefault("rival_frames", []).append(row)
        print(frames_line(row), flush=True)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(f"benchmark.py: {error}")
