"""Case 16: frames after moves, cameras and threads, against the same frames of new renderers: every bit the same.

A history is a scene, a method with options, and steps: an object is placed anew, or the camera moves, turns its ``up``
or changes its size; after each a frame. A history's choices are made by ``pick``, which takes one of several values:
at random here, by Hypothesis in the tests.
"""

from __future__ import annotations

import dataclasses
import functools
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import ldtrefl

from .outcomes import Outcome

NAME = "16 histories"

Pick = Callable[[Sequence[Any]], Any]

OPTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "ldt": ("ldt", {}),
    "ldt, error": ("ldt", {"error": 0.5}),
    "ldt, error, three bounces": ("ldt", {"error": 1.0, "max_bounces": 3}),
    "ldt, error, linear": ("ldt", {"error": 1.0, "search": "linear", "linear_steps": 64}),
    "ldt, three bounces": ("ldt", {"max_bounces": 3}),
    "ldt, linear": ("ldt", {"search": "linear", "resolution": 32, "linear_steps": 64}),
    "ldt, nothing skipped": ("ldt", {"skip": "none"}),
    "ldt, error, some skipped": ("ldt", {"error": 1.0, "skip": "frames,bounds"}),
    "ldt, flat regions": ("ldt", {"cull": "flat"}),
    "bvh": ("bvh", {}),
    "bvh, two bounces": ("bvh", {"max_bounces": 2}),
    "envmap": ("envmap", {"resolution": 24}),
    "envmap, layered": ("envmap", {"resolution": 24, "projection": "layered"}),
}
"""What histories are rendered by."""

PLACES = ((-1.4, -1.2, 0.2), (-1.0, -1.5, 0.0), (0.2, -1.7, -0.4), (1.3, -1.3, 0.1), (0.0, 3.0, 0.0), (0.0, 0.0, 9.0))
EYES = ((0.0, -5.0, 1.5), (0.3, -2.6, 0.4), (-4.0, -3.0, 2.0), (0.0, -30.0, 3.0), (0.0, -1.02, -3.0))
UPS = ((0.0, 0.0, 1.0), (0.0, 0.4, 1.0), (1.0, 0.0, -0.0), (-1.0, -1.0, 0.3))
SIZES = ((32, 24), (24, 32), (33, 17))
FOVS = (40.0, 90.0, 8.0)
THREADS = 4


def scene(pick: Pick, picture: str) -> ldtrefl.Scene:
    """Two mirrors and three other objects, with or without shadows, under a picture or a plain sky."""
    mirror = ldtrefl.Material(mirror=(0.9, 0.8, 0.7), albedo=(0.1, 0.1, 0.1))
    low = {"segments": [24, 12]}
    return ldtrefl.Scene(
        camera=ldtrefl.Camera(eye=EYES[0], look_at=(0, 0, 0), width=32, height=24, fov_y=40),
        environment=ldtrefl.Environment(image=pick((None, picture))),
        lighting=ldtrefl.Lighting(shadows=pick((False, True))),
        lights=(ldtrefl.Light(kind="directional", direction=(0.3, 0.4, -1), radiance=(2, 2, 2)),),
        objects=(
            ldtrefl.Object(name="ball", shape="sphere", params=low, material=mirror),
            ldtrefl.Object(name="plate", shape="plane", scale=4.0, translate=(0, 0, -1.1)),
            ldtrefl.Object(name="ring", shape="torus", params=low, scale=0.5, translate=(1.5, -1, 0), material=mirror),
            ldtrefl.Object(name="torus", shape="torus", params=low, scale=0.4, translate=PLACES[0]),
            ldtrefl.Object(name="knot", shape="torus_knot", params={"segments": [200, 24]}, scale=0.4),
        ),
    )


def next_camera(pick: Pick, camera: ldtrefl.Camera) -> ldtrefl.Camera:
    """Another camera, or the same."""
    change = pick(("eye", "up", "size", "fov", "nothing"))
    if change == "eye":
        return dataclasses.replace(camera, eye=pick(EYES))
    if change == "up":
        return dataclasses.replace(camera, up=pick(UPS))
    if change == "fov":
        return dataclasses.replace(camera, fov_y=pick(FOVS))
    if change == "size":
        width, height = pick(SIZES)
        return dataclasses.replace(camera, width=width, height=height)
    return camera


def history(pick: Pick, by: str, picture: str, steps: int) -> Iterator[tuple[str, ldtrefl.Frame, ldtrefl.Frame]]:
    """(what was done, the frame, the same of a new renderer) step by step."""
    method, options = OPTIONS[by]
    renderer = ldtrefl.Renderer(scene(pick, picture), method, **options, samples=1)
    camera, done = renderer.scene.camera, "first"
    for _ in range(steps):
        frame = renderer.render(camera)
        yield done, frame, ldtrefl.Renderer(renderer.scene, method, **options, samples=1).render(camera)
        done = pick(("move", "move twice", "turn", "camera", "camera", "camera"))
        if done == "camera":
            camera = next_camera(pick, camera)
        elif done == "turn":
            renderer.move(pick(("torus", "ring", "knot")), rotate=(1, 1, 0, pick((20.0, 90.0))), scale=0.4)
        else:
            for _ in range(1 + (done == "move twice")):
                renderer.move(pick(("torus", "ring", "knot")), translate=pick(PLACES))


def difference(frame: ldtrefl.Frame, other: ldtrefl.Frame) -> str:
    """The first thing in which two frames differ; nothing if they are the same to the bit."""
    for name in ("image", "reflection", "reflector_mask"):
        if getattr(frame, name).tobytes() != getattr(other, name).tobytes():
            return name
    mine, right = (() if hits is None else (hits, *hits.later) for hits in (frame.hits, other.hits))
    if len(mine) != len(right):
        return "the number of bounces"
    for bounce, (hits, expected) in enumerate(zip(mine, right, strict=True), start=1):
        for name in ("distance", "object", "triangle"):
            if getattr(hits, name).tobytes() != getattr(expected, name).tobytes():
                return f"{name} at bounce {bounce}"
    return ""


def in_threads(calls: Sequence[Callable[[], None]]) -> None:
    """Make calls in threads that begin together; the first exception of any is raised here."""
    gate, failures = threading.Barrier(len(calls)), []

    def run(call: Callable[[], None]) -> None:
        try:
            gate.wait()
            call()
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=run, args=(call,)) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]


def wrong_frames(given: ldtrefl.Scene, by: str, renderers: Sequence[ldtrefl.Renderer], rounds: int) -> tuple[int, int]:
    """(frames that are wrong, all) of threads that share ``renderers`` in turn, each with a camera of its own."""
    method, options = OPTIONS[by]
    cameras = [dataclasses.replace(given.camera, eye=eye, up=up) for eye, up in zip(EYES, UPS, strict=False)]
    truths = [ldtrefl.Renderer(given, method, **options, samples=1).render(camera) for camera in cameras]
    made: list[tuple[int, ldtrefl.Frame]] = []

    def work(k: int) -> None:
        renderer = renderers[k % len(renderers)]
        for _ in range(rounds):
            made.append((k, renderer.render(cameras[k])))

    in_threads([functools.partial(work, k) for k in range(THREADS)])
    return sum(bool(difference(frame, truths[k])) for k, frame in made), len(made)


def run(rays: int, pictures: int) -> list[Outcome]:
    """``pictures`` histories by every method, and as many rounds of threads that share a renderer or have one each."""
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        picture = sky(Path(folder))
        for number, by in enumerate(OPTIONS):
            outcome = Outcome(NAME, "moves and cameras", by, limit="every bit that of a new renderer")
            start = time.perf_counter()
            random = np.random.default_rng(number)
            for _ in range(pictures):
                for _, frame, truth in history(picker(random), by, picture, min(8, 3 * pictures)):
                    outcome.tried += 1
                    outcome.defects += bool(difference(frame, truth))
            outcome.seconds, outcome.passed = time.perf_counter() - start, outcome.defects == 0
            outcomes.append(outcome)
            outcomes.append(threads_case(random, by, picture, pictures))
    return outcomes


def threads_case(random: np.random.Generator, by: str, picture: str, rounds: int) -> Outcome:
    """Threads that share one renderer, and threads with one each."""
    outcome = Outcome(NAME, f"{THREADS} threads", by, limit="every bit that of a new renderer")
    start = time.perf_counter()
    given, (method, options) = scene(picker(random), picture), OPTIONS[by]
    for count in (1, THREADS):
        renderers = [ldtrefl.Renderer(given, method, **options, samples=1) for _ in range(count)]
        wrong, tried = wrong_frames(given, by, renderers, rounds)
        outcome.defects += wrong
        outcome.tried += tried
    outcome.seconds, outcome.passed = time.perf_counter() - start, outcome.defects == 0
    return outcome


def picker(random: np.random.Generator) -> Pick:
    """A ``Pick`` that chooses at random."""
    return lambda values: values[int(random.integers(len(values)))]


def sky(folder: Path) -> str:
    """The path of a picture for the environment, which looks different in every direction."""
    path = folder / "sky.exr"
    ldtrefl.save_image(path, np.random.default_rng(3).uniform(0.0, 2.0, (8, 16, 3)).astype(np.float32))
    return str(path)
