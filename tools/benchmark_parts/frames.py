"""Whole frames: stages, and what ``error`` asks for against what comes of it."""

from __future__ import annotations

import dataclasses
import itertools
import os
import statistics

import numpy as np

import ldtrefl
from ldtrefl.compare import metrics
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Scene

from .common import ROOT, SKIPS_BUT_FRAMES, knot_scene
from .our_frames import median_stages
from .paper import PAPER_TABLE_2
from .result import ErrorTarget


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
