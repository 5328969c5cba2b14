"""Whole frames of ours beside Mitsuba's, or beside those of another checkout, made in turn."""

from __future__ import annotations

import functools
import gc
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Protocol

from mitsuba_parts.judge import is_off
from mitsuba_parts.mitsuba_frames import MITSUBA_FRAMES, LitFrames
from mitsuba_parts.mitsuba_scene import mitsuba
from timing import timed_in_turn

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.scene.description import Scene

from .checkout_frames import CheckoutFrames
from .common import ROOT
from .frame_scenes import FRAME_SCENES, LARGEST, frame_scene
from .our_frames import METHODS, OurFrames, median_stages
from .result import FrameRow

THREADS = 2
"""Of every frame, whoever makes it."""

SMALL_KNOT = "ball, knot 96 k"
LARGER_KNOTS = ("ball, knot 500 k", "ball, knot 2 M", LARGEST)
"""In whose turns ``ldt`` makes frames of ``SMALL_KNOT``, too: how time grows with triangles is then a ratio in turn."""
ON_SMALL_KNOT = "ldt, knot 96 k"

USUAL_SCENES = tuple(name for name in FRAME_SCENES if name != LARGEST)
QUICK_SCENES = "ball, knot 500 k", "teapot"
QUICK_SIZE = 96, 64


class FrameMaker(Protocol):
    """Makes frames of one scene, each with the camera moved."""

    first: float
    """Seconds of the first frame, made before."""

    @property
    def stages(self) -> dict[str, float]:
        """Seconds of each stage of the last frame."""

    def frame(self) -> float:
        """Seconds of the next frame."""


def mitsuba_note() -> str | None:
    """Why Mitsuba cannot make frames here; None if it can."""
    try:
        mitsuba()
    except InputError as error:
        return f"Frames without Mitsuba: {error}"
    return None


def frames_beside_mitsuba(name: str, size: tuple[int, int] | None, rounds: int, with_mitsuba: bool) -> FrameRow:
    """Frames of the scene called ``name`` by our methods and by Mitsuba, all in this process."""
    scene = frame_scene(name, size)
    row = _row(name, scene)
    ours = {method: OurFrames(scene, method, THREADS) for method in METHODS}
    makers: dict[str, FrameMaker] = dict(ours)
    if name in LARGER_KNOTS:
        makers[ON_SMALL_KNOT] = OurFrames(frame_scene(SMALL_KNOT, size), "ldt", THREADS)
    for kind in MITSUBA_FRAMES if with_mitsuba else ():
        theirs = kind(scene, THREADS)
        makers[kind.name] = theirs
        if kind is LitFrames:
            row["unlike"] = 100.0 * float(is_off(theirs.picture, ours["bvh"].picture).mean())
    _time(row, makers, rounds)
    ldtrefl.set_threads()
    del makers, ours, scene
    gc.collect()  # Dr.Jit's scenes refer to themselves
    return row


def frames_beside_before(name: str, size: tuple[int, int] | None, rounds: int, before: Path) -> FrameRow:
    """Frames of the scene called ``name`` by this checkout and by that in the folder ``before``, each method in a
    process of its own."""
    row = _row(name, frame_scene(name, size))
    with ExitStack() as stack:
        makers = {}
        for method in METHODS:
            for label, checkout in ((method, ROOT), (f"{method} before", before)):
                made = CheckoutFrames(checkout, name, size, method, THREADS)
                makers[label] = stack.enter_context(made)
        _time(row, makers, rounds)
    return row


def _row(name: str, scene: Scene) -> FrameRow:
    camera = scene.camera
    return {
        "scene": name,
        "triangles": sum(len(entry.geometry.faces) for entry in scene.objects),
        "size": (camera.width, camera.height),
        "bounces": scene.reflection.max_bounces,
        "threads": THREADS,
        "makers": {},
        "unlike": None,
    }


def _time(row: FrameRow, makers: Mapping[str, FrameMaker], rounds: int) -> None:
    """Make frames in turn, and put what they took into the row.

    In each turn a maker makes two frames, and the second counts: caches then hold what they hold when nobody else makes
    frames.
    """
    stages: dict[str, list[dict[str, float]]] = {label: [] for label in makers}

    def turn(label: str) -> float:
        makers[label].frame()
        seconds = makers[label].frame()
        stages[label].append(makers[label].stages)
        return seconds

    times = timed_in_turn({label: functools.partial(turn, label) for label in makers}, rounds)
    for label, maker in makers.items():
        row["makers"][label] = {
            "milliseconds": times[label],
            "first": 1000.0 * maker.first,
            "stages": median_stages(stages[label][1:]),
        }


def frames_line(row: FrameRow) -> str:
    """The medians."""
    medians = ", ".join(f"{label} {entry['milliseconds']['median']:.1f}" for label, entry in row["makers"].items())
    return f"{row['scene']:26s} {row['triangles']:9d}  ms a frame: {medians}"
