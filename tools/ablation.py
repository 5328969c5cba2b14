"""What each skip is worth: time with and without it, in turn, in one process; the counter that it moves; whether the
picture is the same; and culling's figures.

    python tools/ablation.py             # five minutes; writes tools/results/ablation.json and ablation.md
    python tools/ablation.py --quick     # small pictures of a few scenes, for the shape of the output

Scenes with meshes of LDTREFL_MESH_PATH are left out where they are missing. Times are medians in milliseconds; what no
skip can change (G-buffer, composite) is left out of them, except where a whole frame is meant.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import functools
import json
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypedDict

import numpy as np
from timing import in_turn

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.device import launch
from ldtrefl.files.atomic_write import written_whole
from ldtrefl.frame.camera_shading import shade_gbuffer
from ldtrefl.frame.skip_options import skip_names
from ldtrefl.renderer import Frame, Renderer
from ldtrefl.scene.description import Camera, Material, Object, Scene
from ldtrefl.tracing.nothing import no_shadows

ROOT = Path(__file__).parent.parent
SHIPPED = ("teapot", "wall", "bowl_mirror", "torus_mirror", "genus3_knot", "three_genus3")
PAPER = ("two_balls", "knotty_cup", "buddha", "two_elephants", "three_dancers", "tyra")
MIRROR = Material(mirror=(0.9, 0.9, 0.9))
COUNTERS = {
    "reflection": "objects_peeled",
    "regions": "searches",
    "maps": "map_bytes",
    "bounds": "searches",
    "attributes": "attribute_bytes",
    "frames": "rays",
}
"""What each skip makes less of."""
OUTSIDE = ("gbuffer", "composite")
"""Stages that culling, maps and searches do not change."""


class SkipRow(TypedDict):
    """A scene with a skip and without it."""

    skip: str
    scene: str
    milliseconds: dict[str, float]
    """"with" and "without" the skip: medians."""
    ratio: float
    """Median over the rounds of the time with it over the time without."""
    counter: dict[str, int]
    """"with" and "without" the skip: what ``COUNTERS`` names."""
    same: bool
    """Whether both pictures have the same bits."""


class CullingRow(TypedDict):
    """What culling does in a scene. "safe" and "flat" are the values of the option ``cull``."""

    scene: str
    rays: int
    entering: int
    """Pairs of a ray and another object's bounding sphere that it enters."""
    handed: int
    """Pairs of a ray and an object that were searched."""
    lost: dict[str, int]
    """Pixels that differ from those of a frame without culling."""
    hits: int
    milliseconds: dict[str, float]
    share_of_frame: float
    """Of "safe", in a frame's time."""


class Result(TypedDict):
    """What is written to ``ablation.json``."""

    date: str
    threads: int
    rounds: int
    skips: list[SkipRow]
    culling: list[CullingRow]


def away_from(scene: Scene) -> Scene:
    """The same scene with the camera turned round: no reflector in view."""
    eye, look_at = np.array(scene.camera.eye), np.array(scene.camera.look_at)
    behind = tuple((2 * eye - look_at).tolist())
    return scene.with_camera(dataclasses.replace(scene.camera, look_at=behind))


def glowing(scene: Scene) -> Scene:
    """The same scene with everything but the mirrors glowing."""
    lamp = Material(albedo=(0, 0, 0), emission=(0.6, 0.5, 0.3))
    objects = [o if o.is_reflector else dataclasses.replace(o, material=lamp) for o in scene.objects]
    return dataclasses.replace(scene, objects=tuple(objects))


def with_new_meshes(scene: Scene) -> Scene:
    """The same scene, nothing known of its files' meshes but corners, triangles and texture coordinates."""
    objects = []
    for entry in scene.objects:
        mesh = entry.geometry
        if entry.mesh is not None:
            anew = ldtrefl.Mesh(mesh.vertices, mesh.faces, uvs=mesh.uvs, parts=mesh.parts)
            objects.append(dataclasses.replace(entry, mesh=anew))
        else:
            objects.append(entry)
    return dataclasses.replace(scene, objects=tuple(objects))


def crowd(segments: tuple[int, int], count: int) -> Scene:
    """A mirror ball of so many segments in a crowd of knots."""
    rng = np.random.default_rng(0)
    objects = [Object(name="ball", shape="sphere", params={"segments": list(segments)}, material=MIRROR)]
    for i in range(count):
        place = rng.normal(size=3)
        place *= rng.uniform(1.5, 3.0) / np.linalg.norm(place)
        place[1] = -abs(place[1])
        scale, (x, y, z) = float(rng.uniform(0.1, 0.3)), place.tolist()
        knot = {"segments": [200, 30]}
        objects.append(Object(name=f"knot {i}", shape="torus_knot", params=knot, scale=scale, translate=(x, y, z)))
    return Scene(camera=Camera(eye=(0, -6, 1), look_at=(0, 0, 0), fov_y=35.0), objects=tuple(objects))


def heavy() -> Scene:
    """A mirror ball, a knot of 500,000 triangles that stands still, and a torus to be moved."""
    knot = {"segments": [2500, 100]}
    return Scene(
        camera=Camera(eye=(0, -5, 1.2), look_at=(0, 0, 0), fov_y=35.0),
        objects=(
            Object(name="ball", shape="sphere", material=MIRROR),
            Object(name="knot", shape="torus_knot", params=knot, translate=(1.3, -1.3, 0.2), scale=0.8),
            Object(name="moved", shape="torus", scale=0.15, translate=(-1.0, -1.2, 0.3)),
        ),
    )


def scenes(quick: bool) -> dict[str, Scene]:
    """Name -> scene."""
    found: dict[str, Scene] = {}
    for folder, names in ((ROOT / "scenes", SHIPPED), (ROOT / "scenes" / "paper", PAPER)):
        for name in names[:1] if quick else names:
            try:
                found[name if folder.name == "scenes" else f"paper/{name}"] = ldtrefl.load_scene(
                    folder / f"{name}.toml"
                )
            except ldtrefl.InputError as error:
                print(f"left out: {error}", file=sys.stderr)
    found["teapot, camera turned away"] = away_from(found["teapot"])
    if "paper/buddha" in found:
        found["glowing buddha"] = glowing(found["paper/buddha"])
    found["crowd of 50"] = crowd((64, 32) if quick else (1000, 500), 50)
    found["heavy knot"] = heavy()
    if quick:
        found = {n: s.with_camera(dataclasses.replace(s.camera, width=96, height=64)) for n, s in found.items()}
    return found


def compared(jobs: dict[str, Callable[[], float]], rounds: int) -> tuple[dict[str, float], float]:
    """Median of what each of two jobs says it took, in milliseconds, and the median over the rounds of the share that
    the first has of the second's."""
    spent = in_turn(jobs, rounds)
    first, second = spent.values()
    ratio = statistics.median(a / b for a, b in zip(first, second, strict=True))
    return {name: statistics.median(values) for name, values in spent.items()}, ratio


def all_but(*names: str) -> list[str]:
    """Every skip but these."""
    return [name for name in skip_names() if name not in names]


def same(a: Frame, b: Frame) -> bool:
    """Whether two frames are the same to the bit."""
    return np.array_equal(a.image, b.image) and np.array_equal(a.reflection, b.reflection)


def ablate(name: str, scene: Scene, skip: str, rounds: int) -> SkipRow:
    """Time and counter of the scene called ``name`` with a skip and without it."""
    if skip in ("maps", "attributes"):
        made = {"with": skip_names(), "without": all_but(skip)}
        frames: dict[str, Frame] = {}

        def first_frame(way: str) -> float:
            anew = with_new_meshes(scene)
            start = time.perf_counter()
            frames[way] = Renderer(anew, "ldt", skip=made[way], samples=1).render()
            return time.perf_counter() - start

        times, ratio = compared({way: functools.partial(first_frame, way) for way in made}, rounds)
    else:
        # But to measure what is kept between frames, every frame is made anew.
        kept = () if skip == "frames" else ("frames",)
        renderers = {
            "with": Renderer(scene, "ldt", skip=all_but(*kept), samples=1),
            "without": Renderer(scene, "ldt", skip=all_but(*kept, skip), samples=1),
        }
        firsts = {way: renderer.render() for way, renderer in renderers.items()}
        frames = {}

        def next_frame(way: str) -> float:
            start = time.perf_counter()
            frames[way] = renderers[way].render()
            whole = time.perf_counter() - start
            stages = frames[way].stats.seconds
            return whole if skip == "frames" else whole - sum(stages.get(stage, 0.0) for stage in OUTSIDE)

        times, ratio = compared({way: functools.partial(next_frame, way) for way in renderers}, rounds)
        if skip == "reflection":  # maps are made in the first frame
            for way, first in firsts.items():
                frames[way].stats.counters["objects_peeled"] = first.stats.counters.get("objects_peeled", 0)
    counter = COUNTERS[skip]
    return {
        "skip": skip,
        "scene": name,
        "milliseconds": times,
        "ratio": ratio,
        "counter": {way: frame.stats.counters.get(counter, 0) for way, frame in frames.items()},
        "same": same(frames["with"], frames["without"]),
    }


def moved(name: str, scene: Scene, rounds: int) -> SkipRow:
    """What ``frames`` is worth in the heavy scene, called ``name``, where its torus moves before every frame."""
    renderers = {
        "with": Renderer(scene, "ldt", samples=1),
        "without": Renderer(scene, "ldt", skip=all_but("frames"), samples=1),
    }
    frames: dict[str, Frame] = {}
    step = dict.fromkeys(renderers, 0)

    def next_frame(way: str) -> float:
        step[way] += 1
        renderers[way].move("moved", translate=(-1.0, -1.2, 0.3 + 0.01 * step[way]))
        start = time.perf_counter()
        frames[way] = renderers[way].render()
        return time.perf_counter() - start

    times, ratio = compared({way: functools.partial(next_frame, way) for way in renderers}, rounds)
    return {
        "skip": "frames",
        "scene": f"{name}, torus moved",
        "milliseconds": times,
        "ratio": ratio,
        "counter": {way: frame.stats.counters["rays"] for way, frame in frames.items()},
        "same": same(frames["with"], frames["without"]),
    }


def culling(name: str, scene: Scene, rounds: int) -> CullingRow | None:
    """Rays handed to the search against rays that enter a bounding sphere; pixels lost; what culling takes. None for a
    scene without reflected rays."""
    renderers = {
        "none": Renderer(scene, "ldt", skip=all_but("frames", "regions", "bounds"), samples=1),
        "safe": Renderer(scene, "ldt", skip=all_but("frames"), samples=1),
        "flat": Renderer(scene, "ldt", skip=all_but("frames"), cull="flat", samples=1),
    }
    frames = {way: renderer.render() for way, renderer in renderers.items()}
    if not frames["safe"].stats.counters["rays"]:
        return None
    truth = frames["none"]
    lost = {way: int((frame.image != truth.image).any(axis=2).sum()) for way, frame in frames.items()}
    share: dict[str, float] = {}

    def cull(way: str) -> float:
        seconds = renderers[way].render().stats.seconds
        share[way] = seconds["cull"] / sum(seconds.values())
        return seconds["cull"]

    times, _ = compared({way: functools.partial(cull, way) for way in ("safe", "flat")}, rounds)
    entering = rays_that_enter(renderers["safe"])
    return {
        "scene": name,
        "rays": frames["safe"].stats.counters["rays"],
        "entering": entering,
        "handed": frames["safe"].stats.counters["searches"],
        "lost": lost,
        "hits": int((truth.hits.object >= 0).sum()) if truth.hits is not None else 0,
        "milliseconds": times,
        "share_of_frame": share["safe"],
    }


def rays_that_enter(renderer: Renderer) -> int:
    """Pairs of a reflected ray of the last frame and another object's bounding sphere that it meets, in float64."""
    assert renderer.gbuffer is not None
    no_shadow, count = no_shadows(renderer.gbuffer.scene.device), 0
    rays = shade_gbuffer(renderer.gbuffer, no_shadow, starts_rays=True).rays
    origin, direction = rays.origin.numpy().astype(float), rays.direction.numpy().astype(float)
    source = rays.source.numpy()
    for entry in renderer.gbuffer.scene.objects:
        offset = entry.centre - origin
        along = (offset * direction).sum(axis=1)
        square, radius = (offset**2).sum(axis=1), entry.radius
        meets = (square <= radius**2) | ((square - along**2 <= radius**2) & (along > 0))
        count += int((meets & (source != entry.index)).sum())
    return count


def typical_and_best(rows: list[SkipRow]) -> list[str]:
    """Lines of a table: each skip's ratio in a typical scene (the median over all), in the best and in the worst."""
    lines = ["Time with the skip over time without it: the median over the scenes, the best scene and the worst.", ""]
    lines += ["| skip | typical | best | worst |", "|---|---|---|---|"]
    for skip in skip_names():
        ratios = sorted((row["ratio"], row["scene"]) for row in rows if row["skip"] == skip)
        typical = statistics.median(ratio for ratio, _ in ratios)
        (best, best_scene), (worst, worst_scene) = ratios[0], ratios[-1]
        lines.append(f"| {skip} | {typical:.2f} | {best:.2f} ({best_scene}) | {worst:.2f} ({worst_scene}) |")
    return lines


def table(result: Result) -> str:
    """The result in Markdown."""
    measured = f"Measured on {result['date']}, {result['threads']} threads; medians of {result['rounds']} rounds."
    lines = ["# What each skip is worth", "", measured, "", *typical_and_best(result["skips"]), "", "## By scene", ""]
    lines += ["| skip | scene | with, ms | without, ms | ratio | counter | with | without | same picture |"]
    lines += ["|---|---|---|---|---|---|---|---|---|"]
    for row in result["skips"]:
        times, counter = row["milliseconds"], row["counter"]
        lines.append(
            f"| {row['skip']} | {row['scene']} | {times['with']:.2f} | {times['without']:.2f} | {row['ratio']:.2f} | "
            f"{COUNTERS[row['skip']]} | {counter['with']} | {counter['without']} | {'yes' if row['same'] else 'NO'} |"
        )
    lines += ["", "## Culling", ""]
    lines += ["| scene | rays | enter a sphere | handed on | ratio | pixels lost: safe | flat | safe, ms | flat, ms |"]
    lines += ["|---|---|---|---|---|---|---|---|---|"]
    for found in result["culling"]:
        flat = f"{found['lost']['flat']} ({100.0 * found['lost']['flat'] / max(found['hits'], 1):.2f}% of hits)"
        times = found["milliseconds"]
        lines.append(
            f"| {found['scene']} | {found['rays']} | {found['entering']} | {found['handed']} | "
            f"{found['handed'] / max(found['entering'], 1):.2f} | {found['lost']['safe']} | {flat} | "
            f"{times['safe']:.2f} ({100.0 * found['share_of_frame']:.1f}% of the frame) | {times['flat']:.2f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write what was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small pictures of a few scenes")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "tools" / "results", help="folder for the results")
    given = parser.parse_args()
    rounds = 2 if given.quick else 15
    today = datetime.date.today().isoformat()
    result: Result = {
        "date": today,
        "threads": launch.thread_count(),
        "rounds": rounds,
        "skips": [],
        "culling": [],
    }
    for name, scene in scenes(given.quick).items():
        for skip in skip_names():
            row = ablate(name, scene, skip, rounds)
            result["skips"].append(row)
            print(f"{name}: {skip} {row['ratio']:.2f} {'same' if row['same'] else 'NOT THE SAME'}", flush=True)
        if name == "heavy knot":
            result["skips"].append(moved(name, scene, rounds))
        figures = culling(name, scene, rounds)
        if figures is not None:
            result["culling"].append(figures)
    given.output.mkdir(parents=True, exist_ok=True)
    with written_whole(given.output / "ablation.json") as scratch:
        scratch.write_text(json.dumps(result, indent=1) + "\n")
    with written_whole(given.output / "ablation.md") as scratch:
        scratch.write_text(table(result))


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(f"ablation.py: {error}")
