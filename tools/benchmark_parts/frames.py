"""Whole frames: error against time, stages, and what ``error`` asks for against what comes of it."""

from __future__ import annotations

import dataclasses
import itertools
import os
import statistics
from typing import Any

import numpy as np
from timing import timed_in_turn

import ldtrefl
from ldtrefl.compare import metrics
from ldtrefl.device import launch
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Scene

from .common import ROOT, SKIPS_BUT_FRAMES, knot_scene
from .our_frames import median_stages
from .paper import PAPER_TABLE_2
from .result import ErrorPoint, ErrorTarget


def error_against_time(quick: bool, rounds: int) -> list[ErrorPoint]:
    """Frames of the ball and the knot by every method and parameter: time per frame, maps kept, and image error."""
    ldtrefl.set_threads()
    size = (192, 128) if quick else (768, 512)
    full = (200, 25) if quick else (2000, 125)
    scene = knot_scene(full, *size)
    truth = ldtrefl.render(scene, "bvh", samples=1)
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
    points: list[ErrorPoint] = []
    renderers = [
        Renderer(where, method, skip=SKIPS_BUT_FRAMES, **options, samples=1) for _, _, where, method, options in curves
    ]
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


def frame_stages(quick: bool, rounds: int) -> dict[str, dict[str, float]]:
    """Where the time of a frame goes, nothing kept but the kernels."""
    scene = knot_scene((200, 25) if quick else (2000, 125), *((192, 128) if quick else (768, 512)))
    stages: dict[str, dict[str, float]] = {}
    for threads in sorted({1, min(2, os.cpu_count() or 1)}):
        ldtrefl.set_threads(threads)
        for method in ("ldt", "bvh"):
            first: list[dict[str, float]] = []
            moved: list[dict[str, float]] = []
            for _ in range(rounds + 1):
                renderer = Renderer(scene, method, samples=1)
                first.append(renderer.render().stats.seconds)
                # A camera that moves: the maps stay, everything else is done again.
                camera = dataclasses.replace(scene.camera, eye=(0.001 * len(first) - 0.5, -4.5, 0.8))
                moved.append(renderer.render(camera=camera).stats.seconds)
            stages[f"{method}, {threads} threads, first frame"] = _stages_and_total(first[1:])
            stages[f"{method}, {threads} threads, camera moved"] = _stages_and_total(moved[1:])
    return stages


def _stages_and_total(frames: list[dict[str, float]]) -> dict[str, float]:
    return median_stages(frames) | {"total": 1000 * statistics.median(sum(frame.values()) for frame in frames)}


def error_targets(quick: bool, rounds: int) -> list[ErrorTarget]:
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
    rows: list[ErrorTarget] = []
    for name, scene in found.items():
        truth = ldtrefl.render(scene, "bvh", samples=1)
        for search, error in itertools.product(("exact", "linear"), (None, 0.5, 2.0)):
            Renderer(scene, "ldt", search=search, error=error, samples=1).render()  # compiles
            renderer = Renderer(scene, "ldt", search=search, error=error, skip=SKIPS_BUT_FRAMES, samples=1)
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
