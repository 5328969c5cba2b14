"""Error against time and memory: frames of two scenes by every method."""

from __future__ import annotations

import functools

from timing import timed_in_turn

import ldtrefl
from ldtrefl.compare import metrics
from ldtrefl.device import launch
from ldtrefl.frame.result import Frame

from .method_memory import memory_of_run
from .method_runs import FULL, QUICK, SCENES, every_run
from .result import ErrorPoint

FULL_SIZE, QUICK_SIZE = (768, 512), (192, 128)

SLOW = 1000.0
"""Milliseconds from which a frame is timed once: some methods take a hundred times as long as others."""

MEMORY_OF_QUICK = ("ldt", "planar")
"""Methods whose memory a quick run measures, for each takes a process."""


def error_against_time(quick: bool, rounds: int) -> list[ErrorPoint]:
    """Frames by every method and parameter: time per frame, maps and trees kept, memory, and the image's error.

    The camera and all objects stay, so that what is made of them once is no part of the time.
    """
    ldtrefl.set_threads()
    size = QUICK_SIZE if quick else FULL_SIZE
    runs = every_run(quick)
    renderers = [run.renderer(*size) for run in runs]
    frames: dict[int, Frame] = {}

    def render(number: int) -> None:
        frames[number] = renderers[number].render()

    jobs = {str(i): functools.partial(render, i) for i in range(len(runs))}
    times = timed_in_turn(jobs, 1)
    fast = {i: job for i, job in jobs.items() if times[i]["median"] < SLOW}
    times |= timed_in_turn(fast, max(2, rounds // 2))
    points: list[ErrorPoint] = []
    for scene, made in SCENES.items():
        truth = ldtrefl.render(made(QUICK if quick else FULL, *size), "bvh", samples=1)
        mask = truth.reflector_mask
        for i, run in enumerate(runs):
            if run.scene != scene:
                continue
            image = frames[i].image
            measures_memory = run.is_usual and (not quick or run.method in MEMORY_OF_QUICK)
            points.append(
                {
                    "scene": scene,
                    "curve": run.curve,
                    "label": run.label,
                    "threads": launch.thread_count(),
                    "milliseconds": times[str(i)],
                    "ssim": metrics.ssim(image, truth.image, mask),
                    "flip": metrics.flip(image, truth.image, mask),
                    "relmse": metrics.relmse(image, truth.image, mask),
                    "is_usual": run.is_usual,
                    "memory": memory_of_run(run, size) if measures_memory else None,
                }
            )
    return points
