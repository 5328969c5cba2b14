"""Run time against error: layered depth textures, Warp's BVH and Embree on the same rays and the same scenes.

Everything is timed in turn in one process (A B A B ...), with compilation and a first round outside the clock; figures
are medians, with the fastest and slowest beside them in the JSON. Threads are stated with every figure.

    python tools/benchmark.py            # 10 minutes; writes tools/results/benchmark.json, .md and plots
    python tools/benchmark.py --quick    # one minute, small meshes, for the shape of the output

Real meshes are taken from LDTREFL_MESH_PATH where they are. The rays are those of a 768 x 512 camera, reflected off a
sphere beside the object; the truth is the BVH where Embree, in robust mode, agrees with it.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import itertools
import json
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import trimesh
import warp as wp
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

import ldtrefl
from ldtrefl import launch, metrics, shapes, skips
from ldtrefl.device_scene import DeviceMesh
from ldtrefl.files import written_whole
from ldtrefl.grid_build import Quality
from ldtrefl.ldt import peel_mesh
from ldtrefl.march import TRACERS
from ldtrefl.raycast import BVH, Raycaster
from ldtrefl.render import Renderer
from ldtrefl.scene import Camera, Light, Material, Object, Scene
from ldtrefl.trace import Tracer, batch_kernel

matplotlib.use("Agg")
from matplotlib import pyplot as plt

KNOTS = {
    "knot 1 k": (64, 8),
    "knot 10 k": (200, 25),
    "knot 96 k": (600, 80),
    "knot 500 k": (2000, 125),
    "knot 2 M": (5000, 200),
}
REAL = (
    "happy_buddha.ply",
    "lucy.ply",
    "bunny_open.ply",
    "armadillo.ply",
    "cycloidal_drive.ply",
    "sheen_chair.glb",
    "boot.ply",
    "dish_with_olives.glb",
    "teapot.ply",
    "mosquito_in_amber.ply",
    "spot.glb",
)
SCAN = "lucy.ply, finer"
"""A stand-in for a dense scan: lucy with every triangle in sixteen on Loop's limit surface, roughened by a third of an
edge."""
ERROR_TEXELS = 128
"""Distances are given in texels of a map of this resolution, whatever the map's."""

PAPER_TABLE_1 = {  # model: triangles, layers, milliseconds on an NVIDIA GeForce 7800 (Zhang, Hsieh and Shen)
    "Ball": (1520, 1, 24.783),
    "Hollow-box": (135, 2, 46.489),
    "Dancer": (49996, 2, 50.372),
    "Knotty-cup": (10768, 3, 63.289),
    "Genus3": (13312, 3, 63.592),
    "Elephant": (25086, 3, 65.789),
    "Horse": (96966, 3, 71.075),
    "Armadillo": (49998, 5, 95.328),
    "Tyra": (49998, 5, 95.827),
    "Happy-Buddha": (129484, 5, 110.000),
}
OUR_MODELS = {
    "Ball": "sphere",
    "Hollow-box": "hollow_box",
    "Dancer": "lucy.ply",
    "Knotty-cup": "boot.ply",
    "Genus3": "genus3",
    "Elephant": "spot.glb",
    "Horse": "bunny_open.ply",
    "Armadillo": "armadillo.ply",
    "Tyra": "sheen_chair.glb",
    "Happy-Buddha": "happy_buddha.ply",
}
PAPER_TABLE_2 = {  # scene: milliseconds for reflector and reflection on the same GPU
    "two_balls": (1.013, 1.559),
    "hollow_box": (1.019, 1.612),
    "knotty_cup": (1.023, 2.131),
    "buddha": (1.027, 2.188),
    "armadillo": (1.022, 2.337),
    "tyra": (1.021, 2.342),
    "two_elephants": (1.064, 4.324),
    "two_horses": (1.024, 4.822),
    "three_genus3": (1.013, 5.372),
    "three_dancers": (1.029, 6.261),
}
ROOT = Path(__file__).parent.parent
SKIPS_BUT_FRAMES = [name for name in skips.names() if name != "frames"]
"""So that every frame is made anew."""


def timed_in_turn(jobs: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, dict[str, float]]:
    """Milliseconds of each job: median, fastest, slowest. One round first, outside the clock."""
    spent: dict[str, list[float]] = {name: [] for name in jobs}
    for turn in range(rounds + 1):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            if turn:
                spent[name].append(1000 * (time.perf_counter() - start))
    return {
        name: {"median": statistics.median(values), "min": min(values), "max": max(values)}
        for name, values in spent.items()
    }


def mirror_rays(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) float32 origins and directions in the unit space of an object beside a mirror ball."""
    eye, scale, place = np.array([0, -4.0, 0.6]), 1.3, np.array([0.6, -1.9, 0.5])
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    half = np.tan(np.radians(20.0))
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    rays = forward + (x * half * width / height)[..., None] * right + (y * half)[..., None] * down
    rays = (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3)
    b = rays @ eye
    square = b * b - eye @ eye + 1.0
    rays, b, square = rays[square > 0], b[square > 0], square[square > 0]
    points = eye + (-b - np.sqrt(square))[:, None] * rays
    directions = rays - 2 * (rays * points).sum(axis=1, keepdims=True) * points
    return ((points - place) / scale).astype(np.float32), directions.astype(np.float32)


class Batch:
    """A tracer's kernel over fixed rays, its outputs allocated once."""

    def __init__(self, tracer: Tracer, view: Any, origins: wp.array, directions: wp.array) -> None:
        n, device = origins.shape[0], origins.device
        self.t, self.triangle = wp.empty(n, dtype=float, device=device), wp.empty(n, dtype=int, device=device)
        outputs = [self.t, wp.empty(n, dtype=wp.vec3, device=device), self.triangle]
        outputs += [wp.empty(n, dtype=wp.vec2, device=device), wp.zeros(n, dtype=wp.uint8, device=device)]
        self._view = view  # owns the arrays that the kernel's copy points to
        views = wp.array([view], dtype=tracer.view, device=device)
        self._arguments = [views, wp.vec3d(0.0, 0.0, 0.0), wp.float64(1.0), origins, directions, *outputs]
        self._kernel, self._count, self._device = batch_kernel(tracer), n, device

    def __call__(self) -> None:
        launch.launch(self._kernel, self._count, self._arguments, self._device)


def embree_scene(mesh: ldtrefl.Mesh) -> rtcore_scene.EmbreeScene:
    """An Embree scene; its tree is built at the first ray."""
    scene = rtcore_scene.EmbreeScene(robust=True)
    TriangleMesh(scene, mesh.unit_vertices, mesh.faces)
    scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
    return scene


def grown_by(make: Callable[[], Any]) -> int:
    """Bytes by which this process grows when something is made whose size cannot be asked for; to a few pages."""
    pages = [0, 0]
    for i, job in enumerate((lambda: None, make)):
        made = job()
        pages[i] = int(Path("/proc/self/statm").read_text().split()[1])
        del made
    return max(pages[1] - pages[0], 0) * os.sysconf("SC_PAGE_SIZE")


def errors_of(batch: Batch, truth_t: np.ndarray, truth_triangle: np.ndarray, sure: np.ndarray) -> dict[str, float]:
    """Wrong hits and misses in percent of true hits, distances in texels, same triangle in percent of common hits."""
    hit, true_hit = (batch.triangle.numpy() >= 0) & sure, (truth_triangle >= 0) & sure
    both, hits = hit & true_hit, max(int(true_hit.sum()), 1)
    distance = np.abs(batch.t.numpy()[both].astype(float) - truth_t[both]) * ERROR_TEXELS / 2
    p50, p99, p999 = np.percentile(distance, [50, 99, 99.9]) if both.any() else (0.0, 0.0, 0.0)
    return {
        "wrong_hits": 100.0 * float((hit & ~true_hit).sum()) / hits,
        "wrong_misses": 100.0 * float((true_hit & ~hit).sum()) / hits,
        "median": float(p50),
        "p99": float(p99),
        "p999": float(p999),
        "same_triangle": 100.0 * float((batch.triangle.numpy() == truth_triangle)[both].mean())
        if both.any()
        else 100.0,
    }


def load(name: str) -> ldtrefl.Mesh | None:
    """A knot, a shape, or a real mesh; None where it is missing."""
    if name in KNOTS:
        return shapes.make("torus_knot", {"segments": list(KNOTS[name])})
    if name in shapes.names():
        return shapes.make(name)
    if name == SCAN:
        coarse = load("lucy.ply")
        return None if coarse is None else _finer(coarse)
    for folder in filter(None, os.environ.get("LDTREFL_MESH_PATH", "").split(os.pathsep)):
        if (Path(folder) / name).is_file():
            return ldtrefl.load_mesh(Path(folder) / name)
    return None


def _finer(mesh: ldtrefl.Mesh) -> ldtrefl.Mesh:
    fine = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    fine.merge_vertices(merge_tex=True, merge_norm=True)
    fine = fine.subdivide_loop(iterations=2)
    edge = float(fine.edges_unique_length.mean())
    return ldtrefl.Mesh(
        fine.vertices + 0.3 * edge * np.random.default_rng(0).normal(size=fine.vertices.shape), fine.faces
    )


def rays_on_meshes(names: list[str], width: int, height: int, rounds: int) -> list[dict[str, Any]]:
    """Per mesh: time, error, build time and bytes of every tracer, one thread."""
    ldtrefl.set_threads(1)
    rays = mirror_rays(width, height)
    rows = []
    for name in names:
        mesh = load(name)
        if mesh is None:
            print(f"{name}: not in LDTREFL_MESH_PATH, left out", file=sys.stderr)
            continue
        rows.append(rays_on_mesh(name, ldtrefl.Mesh(mesh.unit_vertices, mesh.faces), *rays, rounds))
        print(_mesh_line(rows[-1]), flush=True)
    return rows


def rays_on_mesh(name: str, mesh: ldtrefl.Mesh, o: np.ndarray, d: np.ndarray, rounds: int) -> dict[str, Any]:
    """One row of :func:`rays_on_meshes`."""
    device = launch.resolve_device(None)
    origins, directions = (wp.array(x, dtype=wp.vec3, device=device) for x in (o, d))
    geometry = DeviceMesh(mesh, device)
    embree, caster = embree_scene(mesh), Raycaster.of(geometry)
    qualities: tuple[Quality, ...] = ("exact", "balanced", "fast")
    maps = {quality: peel_mesh(geometry, quality=quality) for quality in qualities}
    linear = peel_mesh(geometry, search="linear")
    batches = {"bvh": Batch(BVH, caster.view(), origins, directions)}
    batches |= {f"ldt {q}": Batch(TRACERS["exact"], m.view(), origins, directions) for q, m in maps.items()}
    batches["ldt linear"] = Batch(TRACERS["linear"], linear.view("linear"), origins, directions)
    times = timed_in_turn({**batches, "embree": functools.partial(embree.run, o, d)}, rounds)

    # The truth is the BVH's answer where Embree gives the same.
    answer = embree.run(o, d, output=1)
    truth_t, truth_triangle = batches["bvh"].t.numpy(), batches["bvh"].triangle.numpy()
    hit = truth_triangle >= 0
    sure = hit == (answer["primID"] >= 0)
    agreed = hit & sure
    sure[agreed] = np.abs(truth_t[agreed] - answer["tfar"][agreed]) < 2e-4

    makers: dict[str, Callable[[], Any]] = {"bvh": functools.partial(Raycaster.of, geometry)}
    makers["embree"] = functools.partial(embree_scene, mesh)
    makers |= {f"ldt {q}": functools.partial(peel_mesh, geometry, quality=q) for q in qualities}
    makers["ldt linear"] = functools.partial(peel_mesh, geometry, search="linear")
    builds = timed_in_turn(makers, max(1, rounds // 2))
    return {
        "mesh": name,
        "triangles": len(mesh.faces),
        "rays": len(o),
        "hits": int(hit.sum()),
        "unsure": int((~sure).sum()),
        "milliseconds": times,
        "build_milliseconds": builds,
        "bytes": {
            "bvh": grown_by(makers["bvh"]),
            "embree": grown_by(makers["embree"]),
            **{f"ldt {quality}": made.nbytes for quality, made in maps.items()},
            "ldt linear": linear.nbytes,
        },
        "errors": {n: errors_of(b, truth_t, truth_triangle, sure) for n, b in batches.items() if n != "bvh"},
    }


def _mesh_line(row: dict[str, Any]) -> str:
    time_of = {name: entry["median"] for name, entry in row["milliseconds"].items()}
    exact, default = row["errors"]["ldt exact"], row["errors"]["ldt balanced"]
    return (
        f"{row['mesh']:22s} {row['triangles']:8d}  bvh {time_of['bvh']:5.1f}  embree {time_of['embree']:5.1f}  "
        f"exact {time_of['ldt exact']:5.1f} ({exact['wrong_hits'] + exact['wrong_misses']:.3f}%)  "
        f"default {time_of['ldt balanced']:5.1f} ({default['wrong_hits']:.3f}% {default['wrong_misses']:.3f}% "
        f"p99 {default['p99']:.3f})  fast {time_of['ldt fast']:5.1f}  linear {time_of['ldt linear']:6.1f} ms"
    )


def knot_scene(segments: tuple[int, int], width: int, height: int) -> Scene:
    """A mirror ball and a torus knot."""
    knot = Object(
        name="knot",
        shape="torus_knot",
        params={"segments": list(segments)},
        rotate=(1, 0.3, 0, 50),
        scale=0.75,
        translate=(1.2, -1.1, 0.1),
    )
    return Scene(
        camera=Camera(eye=(-0.5, -4.5, 0.8), look_at=(0.4, 0, 0.0), fov_y=36, width=width, height=height),
        lights=(Light(kind="directional", direction=(0.3, 0.8, -0.7), radiance=(1.0, 1.0, 1.0)),),
        objects=(
            Object(name="ball", shape="sphere", material=Material(albedo=(0.02,) * 3, mirror=(0.9,) * 3)),
            knot,
        ),
    )


def error_against_time(quick: bool, rounds: int) -> list[dict[str, Any]]:
    """Frames of the ball and the knot by every method and parameter: time per frame, maps kept, and image error."""
    ldtrefl.set_threads()
    size = (192, 128) if quick else (768, 512)
    full = (200, 25) if quick else (2000, 125)
    scene = knot_scene(full, *size)
    truth = ldtrefl.render(scene, "bvh")
    mask = truth.reflector_mask
    curves: list[tuple[str, str, Scene, str, dict[str, Any]]] = [("bvh", "full mesh", scene, "bvh", {})]
    for columns, rows in [(40, 8), (100, 12), (200, 25), (600, 80)][: 2 if quick else 4]:
        label = f"{2 * columns * rows} triangles"
        curves.append(("bvh, decimated", label, knot_scene((columns, rows), *size), "bvh", {}))
    for resolution in (64, 256) if quick else (32, 64, 128, 256, 512):
        curves.append(("ldt balanced", f"{resolution}", scene, "ldt", {"resolution": resolution}))
        curves.append(("ldt fast", f"{resolution}", scene, "ldt", {"resolution": resolution, "quality": "fast"}))
    curves.append(("ldt exact", "every triangle", scene, "ldt", {"quality": "exact"}))
    for steps in (32, 256) if quick else (16, 32, 64, 128, 256, 512, 1024):
        curves.append(("ldt linear", f"{steps} steps", scene, "ldt", {"search": "linear", "linear_steps": steps}))
    for resolution in (64, 256) if quick else (64, 128, 256, 512, 1024):
        curves.append(("envmap", f"{resolution}", scene, "envmap", {"resolution": resolution}))
    points = []
    renderers = [Renderer(where, method, skip=SKIPS_BUT_FRAMES, **options) for _, _, where, method, options in curves]
    jobs = {str(i): renderer.render for i, renderer in enumerate(renderers)}
    times = timed_in_turn(jobs, max(2, rounds // 2))
    for i, (curve, label, _, _, _) in enumerate(curves):
        image = renderers[i].render().image
        points.append(
            {
                "curve": curve,
                "label": label,
                "threads": launch.thread_count(),
                "milliseconds": times[str(i)],
                "ssim": metrics.ssim(image, truth.image, mask),
                "flip": metrics.flip(image, truth.image, mask),
                "relmse": metrics.relmse(image, truth.image, mask),
            }
        )
    return points


def frame_stages(quick: bool, rounds: int) -> dict[str, Any]:
    """Where the time of a frame goes, nothing kept but the kernels; and how march and peel scale with threads."""
    scene = knot_scene((200, 25) if quick else (2000, 125), *((192, 128) if quick else (768, 512)))
    stages: dict[str, Any] = {}
    for threads in sorted({1, min(2, os.cpu_count() or 1)}):
        ldtrefl.set_threads(threads)
        for method in ("ldt", "bvh"):
            first: list[dict[str, float]] = []
            moved: list[dict[str, float]] = []
            for _ in range(rounds + 1):
                renderer = Renderer(scene, method)
                first.append(renderer.render().stats.seconds)
                # A camera that moves: the maps stay, everything else is done again.
                camera = Camera(**{**vars_of(scene.camera), "eye": (0.001 * len(first) - 0.5, -4.5, 0.8)})
                moved.append(renderer.render(camera=camera).stats.seconds)
            stages[f"{method}, {threads} threads, first frame"] = _median_stages(first[1:])
            stages[f"{method}, {threads} threads, camera moved"] = _median_stages(moved[1:])
    return stages


def vars_of(camera: Camera) -> dict[str, Any]:
    """A camera's fields."""
    return {name: getattr(camera, name) for name in ("eye", "look_at", "up", "fov_y", "width", "height")}


def _median_stages(frames: list[dict[str, float]]) -> dict[str, float]:
    names = list(dict.fromkeys(name for frame in frames for name in frame))
    rows = {name: 1000 * statistics.median(frame.get(name, 0.0) for frame in frames) for name in names}
    return rows | {"total": 1000 * statistics.median(sum(frame.values()) for frame in frames)}


@launch.kernel
def spin(first: int, out: wp.array(dtype=float)):
    i = first + wp.tid()
    x = float(i)
    for _ in range(200):
        x = 1.0001 * x + 0.5
    out[i] = x


def error_targets(quick: bool, rounds: int) -> list[dict[str, Any]]:
    """What ``error`` asks for and what comes of it: pixels, bytes and milliseconds beside the usual resolution."""
    ldtrefl.set_threads()
    found = {}
    for name in ("two_balls",) if quick else PAPER_TABLE_2:
        try:
            found[name] = ldtrefl.load_scene(ROOT / "scenes" / "paper" / f"{name}.toml")
        except ldtrefl.InputError:
            continue
    if "three_dancers" in found:
        found["three_dancers, far"] = _farther(found["three_dancers"], 2.5)
        found["three_dancers, very far"] = _farther(found["three_dancers"], 8.0)
    rows = []
    for name, scene in found.items():
        truth = ldtrefl.render(scene, "bvh")
        for search, error in itertools.product(("exact", "linear"), (None, 0.5, 2.0)):
            Renderer(scene, "ldt", search=search, error=error).render()  # compiles
            renderer = Renderer(scene, "ldt", search=search, error=error, skip=SKIPS_BUT_FRAMES)
            first = renderer.render()
            assert first.hits is not None and truth.hits is not None and renderer.gbuffer is not None
            pixels = metrics.reprojection_errors(first.hits, truth.hits, renderer.gbuffer)
            marches = [1000 * renderer.render().stats.seconds["march"] for _ in range(rounds)]
            rows.append(
                {
                    "scene": name,
                    "search": search,
                    "error": error,
                    "pixels_p50": float(np.percentile(pixels, 50)) if len(pixels) else None,
                    "pixels_p99": float(np.percentile(pixels, 99)) if len(pixels) else None,
                    "bytes": first.stats.counters.get("map_bytes", 0),
                    "peel": 1000 * first.stats.seconds["peel"],
                    "march": statistics.median(marches),
                }
            )
    return rows


def _farther(scene: Scene, factor: float) -> Scene:
    """The same scene with everything but the mirrors moved away from the vertical axis."""
    objects = []
    for entry in scene.objects:
        x, y, z = entry.translate
        place = (factor * x, factor * y, z)
        objects.append(entry if entry.is_reflector else dataclasses.replace(entry, translate=place))
    return dataclasses.replace(scene, objects=tuple(objects))


def thread_scaling(quick: bool, rounds: int) -> dict[str, Any]:
    """Time with one thread over time with two, of peeling, of marching, and of arithmetic alone: the machine's own."""
    device = launch.resolve_device(None)
    knots = {"10 k": KNOTS["knot 10 k"]} if quick else {"500 k": KNOTS["knot 500 k"], "2 M": KNOTS["knot 2 M"]}
    meshes = {}
    for size, segments in knots.items():
        mesh = shapes.make("torus_knot", {"segments": list(segments)})
        meshes[size] = DeviceMesh(ldtrefl.Mesh(mesh.unit_vertices, mesh.faces), device)
    o, d = mirror_rays(768, 512)
    origins, directions = (wp.array(x, dtype=wp.vec3, device=device) for x in (o, d))
    spun = wp.empty(100_000, dtype=float, device=device)
    work: dict[str, Callable[[], Any]] = {"arithmetic": lambda: launch.launch(spin, 100_000, [spun], device)}
    for size, geometry in meshes.items():
        work[f"march {size}"] = Batch(TRACERS["exact"], peel_mesh(geometry).view(), origins, directions)
        work[f"peel {size}"] = functools.partial(peel_mesh, geometry)
        work[f"peel linear {size}"] = functools.partial(peel_mesh, geometry, search="linear")

    def with_threads(threads: int, job: Callable[[], Any]) -> None:
        ldtrefl.set_threads(threads)
        job()

    jobs = {
        f"{name} {threads}": functools.partial(with_threads, threads, job)
        for threads in (1, 2)
        for name, job in work.items()
    }
    times = timed_in_turn(jobs, rounds)
    return {name: times[f"{name} 1"]["median"] / times[f"{name} 2"]["median"] for name in work}


def paper_tables(quick: bool, rounds: int) -> dict[str, Any]:
    """The paper's Tables 1 and 2 beside ours: their milliseconds on a GeForce 7800, ours on this CPU."""
    ldtrefl.set_threads()
    device = launch.resolve_device(None)
    table_1: dict[str, Any] = {}
    for model, (triangles, layers, milliseconds) in PAPER_TABLE_1.items():
        name = OUR_MODELS[model]
        mesh = load(name) if not quick or name in shapes.names() else None
        if mesh is None:
            continue
        geometry = DeviceMesh(mesh, device)
        maps = peel_mesh(geometry, search="linear")
        times = timed_in_turn({"peel": functools.partial(peel_mesh, geometry, search="linear")}, rounds)
        table_1[model] = {
            "paper": {"triangles": triangles, "layers": layers, "milliseconds": milliseconds},
            "ours": {
                "model": name,
                "triangles": len(mesh.faces),
                "layers": max(maps.layers().values()),
                "milliseconds": times["peel"]["median"],
            },
        }
    table_2: dict[str, Any] = {}
    for name, (reflector, reflection) in PAPER_TABLE_2.items():
        try:
            scene = ldtrefl.load_scene(ROOT / "scenes" / "paper" / f"{name}.toml")
        except ldtrefl.InputError:
            continue
        ours = {}
        for search in ("linear", "exact"):
            renderer = Renderer(scene, "ldt", search=search, skip=SKIPS_BUT_FRAMES)
            frames = [renderer.render().stats.seconds for _ in range(rounds + 1)][1:]
            reflecting = [frame["cull"] + frame["march"] + frame["shade"] for frame in frames]
            ours[search] = 1000 * statistics.median(reflecting)
        table_2[name] = {"paper": {"reflector": reflector, "reflection": reflection}, "ours": ours}
        if quick:
            break
    return {"table_1": table_1, "table_2": table_2}


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


def main() -> None:
    """Run all parts and write JSON, Markdown and plots."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small meshes, few rounds")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "tools" / "results", help="folder to write to")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    quick, rounds = arguments.quick, 2 if arguments.quick else 9
    names = ["knot 1 k", "knot 10 k"] if quick else [*KNOTS, *REAL, SCAN]
    result = {
        "machine": f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Warp {wp.__version__}",
        "quick": quick,
        "meshes": rays_on_meshes(names, *((192, 128) if quick else (768, 512)), rounds),
        "error_against_time": error_against_time(quick, rounds),
        "stages": frame_stages(quick, rounds),
        "error_targets": error_targets(quick, rounds),
        "scaling": thread_scaling(quick, rounds),
        "paper": paper_tables(quick, rounds),
    }
    ldtrefl.set_threads()
    for name, text in (("benchmark.json", json.dumps(result, indent=1)), ("benchmark.md", reading(result))):
        with written_whole(arguments.output / name) as scratch:
            scratch.write_text(text)
    draw_plots(result, arguments.output)
    print(f"written to {arguments.output}")


if __name__ == "__main__":
    main()
