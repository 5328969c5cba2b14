"""A scene by every method: pictures, times, memory, and how far each is from the truth."""

from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from benchmark_parts.frame_scenes import moving
from benchmark_parts.growth import growth_of
from timing import in_turn

import ldtrefl
from ldtrefl.base.errors import NotForThisScene
from ldtrefl.compare.metrics import flip, ssim
from ldtrefl.frame.result import Frame
from ldtrefl.scene.description import Scene

from .entries import TRUTH, Entry

ROUNDS = 3
"""Of later frames, all methods in turn."""
MOST_SECONDS = 4.0
"""In which a round of a scene's later frames may begin."""

SLOW = 2000.0
"""Milliseconds: a method whose first frame took longer makes no other, which is said to take as long."""

SMALLER = 4
"""Pixels of a frame along one of the small frame that is made first."""
QUICK = 0.5
"""Seconds: after a small frame that took no longer, a frame of full size is made that does not count."""


@dataclass(frozen=True)
class Figures:
    """What was measured of a method in a scene."""

    first: float
    """Milliseconds from the scene in memory to the picture, all kernels compiled."""
    later: float
    """Milliseconds of a frame after it, the camera moved by a little."""
    kept: int
    """Bytes that the process is larger by, after a frame."""
    peak: int
    """Bytes that it was larger by, at most."""
    ssim: float
    flip: float
    ssim_of_one: float | None
    """SSIM against the truth with one reflection; None for methods that follow all."""
    wrong: float | None
    """Reflected rays that end on another object than the truth's, or on none where that ends on one, or the other way
    round, in percent of all; None for methods that do not say where rays end."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """A method in a scene: figures and a picture, or the line by which it says that it is not made for it."""

    refusal: str = ""
    figures: Figures | None = None
    picture: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3), np.float32))
    """(h, w, 3) linear radiance."""


@dataclass(frozen=True, eq=False)
class SceneOutcome:
    """A scene by all methods."""

    name: str
    about: str
    """What is in it, in a line."""
    by_label: dict[str, Outcome]


class _Truth:
    """A scene by the truth: with all reflections, and with one."""

    def __init__(self, scene: Scene) -> None:
        frame = ldtrefl.render(scene, TRUTH, samples=1)
        self._image, self._mask, self._hits = frame.image, frame.reflector_mask, frame.hits
        self._of_one = self._image
        if scene.reflection.max_bounces > 1:
            self._of_one = ldtrefl.render(scene, TRUTH, samples=1, max_bounces=1).image

    def figures(self, entry: Entry, frame: Frame) -> dict[str, float | None]:
        """The errors of a frame."""
        mask, image = self._mask, frame.image
        wrong = None
        if frame.hits is not None and self._hits is not None:
            wrong = 100.0 * float((frame.hits.object != self._hits.object)[mask].mean())
        return {
            "ssim": ssim(image, self._image, mask),
            "flip": flip(image, self._image, mask),
            "ssim_of_one": ssim(image, self._of_one, mask) if entry.knows_one_reflection else None,
            "wrong": wrong,
        }


def compared(name: str, scene: Scene, entries: Sequence[Entry]) -> SceneOutcome:
    """Render a scene by all methods, with one sample of a pixel."""
    truth = _Truth(scene)
    found = {entry.label: _without_later(scene, entry, truth) for entry in entries}
    firsts = {label: outcome.figures.first for label, outcome in found.items() if outcome.figures is not None}
    jobs = {entry.label: _later_frames(scene, entry) for entry in entries if firsts.get(entry.label, np.inf) <= SLOW}
    spent = in_turn(jobs, ROUNDS, MOST_SECONDS)
    for label, times in spent.items():
        old = found[label]
        assert old.figures is not None
        figures = dataclasses.replace(old.figures, later=statistics.median(times))
        found[label] = dataclasses.replace(old, figures=figures)
    return SceneOutcome(name, _about(scene), found)


def _without_later(scene: Scene, entry: Entry, truth: _Truth) -> Outcome:
    """A method in a scene, but for later frames.

    Nothing else of the scene is on the device: methods share meshes there, and the first would be said to take all.
    """
    first = _FirstFrame(scene, entry)
    try:
        _compile_kernels(scene, entry)
    except NotForThisScene as refusal:
        return Outcome(str(refusal))
    memory = growth_of(first.make)
    errors = truth.figures(entry, first.frame)
    spent = first.milliseconds
    return Outcome("", Figures(spent, spent, **memory, **errors), first.frame.image)  # type: ignore[arg-type]


def _compile_kernels(scene: Scene, entry: Entry) -> None:
    """Make frames that do not count. A larger picture may need other kernels, but of what is slow there is one kind."""
    start = time.perf_counter()
    small = fitted(scene, (max(1, scene.camera.width // SMALLER), max(1, scene.camera.height // SMALLER)))
    _renderer(small, entry).render()
    if time.perf_counter() - start < QUICK:
        _renderer(scene, entry).render()


class _FirstFrame:
    """A new renderer and its first frame."""

    renderer: ldtrefl.Renderer
    frame: Frame
    milliseconds: float

    def __init__(self, scene: Scene, entry: Entry) -> None:
        self._scene, self._entry = scene, entry

    def make(self) -> None:
        """Make both."""
        start = time.perf_counter()
        self.renderer = _renderer(self._scene, self._entry)
        self.frame = self.renderer.render()
        self.milliseconds = 1000.0 * (time.perf_counter() - start)


def _renderer(scene: Scene, entry: Entry) -> ldtrefl.Renderer:
    return ldtrefl.Renderer(scene, entry.method.name, None, samples=1, **entry.options)


def _later_frames(scene: Scene, entry: Entry) -> Callable[[], object]:
    """Renders a frame at each call, the camera moved by a little."""
    renderer, cameras = _renderer(scene, entry), moving(scene.camera)
    return lambda: renderer.render(next(cameras))


def fitted(scene: Scene, size: tuple[int, int]) -> Scene:
    """The scene with a picture of its own shape that just fits into so many pixels across and down."""
    camera = scene.camera
    scale = min(size[0] / camera.width, size[1] / camera.height)
    width, height = (max(1, round(scale * side)) for side in (camera.width, camera.height))
    return scene.with_camera(dataclasses.replace(camera, width=width, height=height))


def _about(scene: Scene) -> str:
    triangles = sum(len(entry.geometry.faces) for entry in scene.objects)
    mirrors = sum(entry.is_reflector for entry in scene.objects)
    bounces = scene.reflection.max_bounces
    return f"{len(scene.objects)} objects, {mirrors} of them mirrors; {triangles:,} triangles; {bounces} reflections"
