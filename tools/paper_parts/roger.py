"""Roger and Holzschuch, "Accurate Specular Reflections in Real-Time" (2006): Figs. 3(c) and 10; and what they print in
"Réflexions spéculaires en temps réel" (in French)."""

from __future__ import annotations

import dataclasses
import functools
import itertools

import numpy as np
import warp as wp
from benchmark_parts.frame_scenes import moving
from timing import timed_in_turn

from ldtrefl.device import launch
from ldtrefl.methods.virtual.fermat_search import Reflection, SearchLimits
from ldtrefl.methods.virtual.reflection_point import find_on_sphere
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Material, Scene

from .scenes import paper_scene, room_of
from .table import GEFORCE_7800, Table

EYE_DISTANCE = 5.0
"""From the middle of a ball of radius 1."""

FARTHEST = 6.0
"""From there, of the points that it mirrors."""

PIXEL = np.radians(30.0) / 512
"""Radians: of a picture of 512 rows and 30 degrees."""

PIXELS = 0.01
"""Area of the triangle of samples at which a search ends, as ``fermat`` has it."""

MOST_ITERATIONS = 40
"""Twice what the paper sees, so that none is cut off there."""

MOST_RESIDUAL = 0.02
"""Radians, as ``fermat`` has it."""

ANGLES = (0, 15, 30, 45, 60, 70, 80, 85, 90)
"""Degrees of incidence, between the rows."""

THEIRS = {60: "5 to 10", 70: "5 to 10", 80: "up to 20", 85: "up to 20"}
"""The paper's words, by the first angle of a row: less than 5 near the middle of the reflector, up to 20 near its
silhouette, 5 to 10 in moderately complex cases."""

POLYGONS = (2_000, 5_000, 10_000, 20_000, 40_000)
ROOMS = {"paper/room_2000": ("about 2,000", 100.0), "paper/room_20000": ("about 20,000", 20.0)}
"""Scene: polygons of theirs and their frames a second."""


def tables(quick: bool) -> list[Table]:
    """Fig. 3(c), Fig. 10 and the French paper's timings."""
    rounds = 2 if quick else 7
    return [_convergence(2_000 if quick else 200_000), _growth(quick, rounds), _rooms(quick, rounds)]


def _random_points(count: int) -> np.ndarray:
    """(count, 3) points around a ball of radius 1."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.asarray(directions * rng.uniform(1.05, FARTHEST, (count, 1)))


def searched(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """(degrees of incidence, iterations, share) of the searches for points that a ball shows; ``share`` is how many of
    those that it ought to show are found."""
    device, eye = launch.resolve_device(None), np.array([EYE_DISTANCE, 0.0, 0.0])
    limits = SearchLimits()
    limits.most_iterations, limits.most_residual = MOST_ITERATIONS, MOST_RESIDUAL
    limits.least_solid_angle = PIXELS * PIXEL**2
    eyes = np.broadcast_to(eye, points.shape)
    given = [wp.array(each, dtype=wp.vec3d, device=device) for each in (eyes, points)]
    reflections = wp.zeros(len(points), dtype=Reflection, device=device)
    launch.launch(find_on_sphere, len(points), [wp.float64(1.0), *given, limits, reflections], device)
    found = reflections.numpy()
    is_found = found["is_found"] == 1
    way = points - eye
    along = np.clip(-(way @ eye) / (way**2).sum(axis=1), 0.0, 1.0)[:, None]
    is_shown = ((eye + along * way) ** 2).sum(axis=1) >= 1.0
    at = found["point"][is_found]
    to_eye = eye - at
    cosine = (to_eye * found["normal"][is_found]).sum(axis=1) / np.linalg.norm(to_eye, axis=1)
    degrees = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return degrees, found["iterations"][is_found], float((is_found & is_shown).sum() / is_shown.sum())


def _convergence(count: int) -> Table:
    degrees, iterations, share = searched(_random_points(count))
    rows: list[list[str | int | float | None]] = []
    for low, high in itertools.pairwise(ANGLES):
        those = iterations[(degrees >= low) & (degrees < high)]
        if not len(those):
            continue
        figures = [float(those.mean()), float(np.percentile(those, 5)), float(np.percentile(those, 95))]
        rows.append([f"{low} to {high}", len(those), THEIRS.get(low, "less than 5"), *figures, int(those.max())])
    text = (
        f"{count:,} random points about a mirror ball, by the angle of incidence where they are seen: 0 is its middle, "
        f"90 its silhouette. A search ends when its triangle covers {PIXELS} pixels, and at {MOST_ITERATIONS} "
        f"iterations; {100 * share:.2f}% of the points that the ball shows are found. At "
        "grazing incidence ours begins next to the reflection (`fermat_search.py` says how it differs from theirs)."
    )
    columns = ["degrees", "points", "theirs", "ours: mean", "5%", "95%", "most"]
    return Table("Roger and Holzschuch, Fig. 3(c): iterations until convergence", GEFORCE_7800, text, columns, rows)


def milliseconds(scene: Scene, methods: list[str], rounds: int) -> dict[str, float]:
    """Median whole frames of a scene by these methods in turn, one sample a pixel, the camera moved before each."""
    jobs = {}
    for method in methods:
        made = scene
        if method == "no reflection":
            flat = [each.changed(material=Material()) if each.is_reflector else each for each in scene.objects]
            made = dataclasses.replace(scene, objects=tuple(flat))
        renderer = Renderer(made, "bvh" if method == "no reflection" else method, samples=1)
        cameras = moving(scene.camera)
        jobs[method] = functools.partial(lambda renderer, cameras: renderer.render(next(cameras)), renderer, cameras)
    return {name: found["median"] for name, found in timed_in_turn(jobs, rounds).items()}


def _growth(quick: bool, rounds: int) -> Table:
    rows: list[list[str | int | float | None]] = []
    for polygons in POLYGONS[:2] if quick else POLYGONS:
        scene = room_of(polygons, quick)
        count = sum(len(each.geometry.faces) for each in scene.objects if not each.is_reflector)
        found = milliseconds(scene, ["no reflection", "envmap", "fermat"], rounds)
        rows.append([count, *found.values()])
    counts, times = (np.array([float(row[i] or 0) for row in rows]) for i in (0, 3))
    slope, start = np.polyfit(counts, times, 1)
    off = np.abs(times - (slope * counts + start)) / times
    text = (
        "A ball in a room that surrounds it, their worst case: milliseconds a frame of 768 x 512. Theirs is a plot up "
        f"to 40,000 polygons and a sentence, that time depends linearly on vertices. Ours is {start:.1f} ms and "
        f"{1000 * slope:.2f} ms for each 1,000 polygons, from which no row is off by more than {100 * off.max():.0f}%."
    )
    columns = ["polygons", "ours: no reflection", "envmap", "fermat"]
    hardware = f"two Pentium IV of 3 GHz, {GEFORCE_7800}"
    return Table("Roger and Holzschuch, Fig. 10: time against polygons", hardware, text, columns, rows)


def _rooms(quick: bool, rounds: int) -> Table:
    rows: list[list[str | int | float | None]] = []
    for name, (polygons, rate) in ROOMS.items():
        scene = paper_scene(name, quick)
        count = sum(len(each.geometry.faces) for each in scene.objects if not each.is_reflector)
        found = milliseconds(scene, ["fermat", "fermat-uv", "bvh"], rounds)
        rows.append([name, polygons, rate, count, *(1000.0 / each for each in found.values())])
    text = (
        "Frames a second of pictures of 768 x 512, the camera moving. Theirs were drawn by the GPU, their size is not "
        "said. Their method is `fermat-uv`; `fermat` is that of the paper in English."
    )
    columns = ["scene", "their polygons", "their Hz", "our triangles", "`fermat`", "`fermat-uv`", "`bvh`"]
    hardware = "Pentium 4 of 2.4 GHz, NVIDIA GeForce 6800 Ultra"
    return Table("Roger and Holzschuch, in French: frames a second", hardware, text, columns, rows)
