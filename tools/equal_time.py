"""Pictures by ours and by Mitsuba 3 in equal time, and how far each is from what Mitsuba makes of 1,024 samples.

    python tools/equal_time.py                 # some minutes; writes tools/results/equal_time.json and .md
    python tools/equal_time.py -o FOLDER       # elsewhere, with all pictures
    python tools/equal_time.py --quick         # a small one, on the screen

Scenes have mirrors and emission alone, so that all that an image needs samples for are edges and textures. Mitsuba
comes with ``pip install -e .[peers]``, and needs an LLVM library of version 16 or newer (DRJIT_LIBLLVM_PATH names it).
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import itertools
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_parts.frame_scenes import moving
from mitsuba_parts.emission_only import emission_only
from mitsuba_parts.mirror_paths import NO_ROULETTE
from mitsuba_parts.mitsuba_scene import camera_place, mitsuba, mitsuba_scene, sampling_camera
from mitsuba_parts.outcome import RESULTS, arguments, write_report

import ldtrefl
from ldtrefl.base.errors import InputError
from ldtrefl.compare.metrics import flip
from ldtrefl.device.launch import thread_count
from ldtrefl.frame.sample_pattern import DEVIATION
from ldtrefl.scene.description import Camera, Scene

ROOT = Path(__file__).parent.parent
SCENES = ("teapot", "two_balls", "torus_mirror", "linked_mirrors", "mirror_room")
EMITTER = "area"
"""Mitsuba's own, which Dr.Jit knows without asking Python."""

TRUE_SAMPLES = 1024
SAMPLES_AT_ONCE = 64
MOST_SHARE = 0.5
"""Of Mitsuba's error in equal time, the most that ours may have."""

ROUNDS = 7
QUICK_SIZE = 192, 128


class MitsubaSampled:
    """A scene by Mitsuba's ``path``, with samples all over the pixels.

    Raises:
        InputError: Mitsuba cannot be used here.
    """

    def __init__(self, scene: Scene) -> None:
        self._mi = mitsuba()
        importlib.import_module("drjit").set_thread_count(thread_count())
        self._scene = mitsuba_scene(scene, emitter=EMITTER)
        self._sensor = sampling_camera(scene.camera, DEVIATION)
        self._place = self._mi.traverse(self._sensor)
        depth = scene.reflection.max_bounces + 1
        self._path: Any = self._mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": NO_ROULETTE})

    def picture(self, camera: Camera, samples: int, seed: int = 0) -> np.ndarray:
        """(h, w, 3) float32."""
        self._place["to_world"] = camera_place(self._mi, camera)
        self._place.update()
        return np.array(self._path.render(self._scene, self._sensor, spp=samples, seed=seed))

    def counts(self) -> Iterator[int]:
        """The numbers of samples, from 2 on, that its sampler takes as they are: others it rounds up."""
        sampler = self._sensor.sampler()
        for count in itertools.count(2):
            sampler.set_sample_count(count)
            if sampler.sample_count() == count:
                yield count

    def truth(self, camera: Camera, samples: int) -> np.ndarray:
        """(h, w, 3) float32: the mean of pictures with other samples each."""
        count = max(1, samples // SAMPLES_AT_ONCE)
        pictures = (self.picture(camera, min(samples, SAMPLES_AT_ONCE), seed) for seed in range(count))
        total = next(pictures).astype(np.float64)
        for picture in pictures:
            total += picture
        return np.asarray(total / count, np.float32)


@dataclass(frozen=True)
class Row:
    """A scene's figures."""

    scene: str
    milliseconds: float
    samples: float
    """Of ours, of a pixel in the mean."""
    error: float
    """FLIP of ours."""
    their_milliseconds: float
    their_samples: int
    """The most that take no longer than ours, or one."""
    their_error: float

    @property
    def passed(self) -> bool:
        """Whether ours is nearer to the truth by as much as it should be."""
        return self.error <= MOST_SHARE * self.their_error


def seconds_of(make: Callable[[Camera], object], cameras: Iterator[Camera], rounds: int) -> float:
    """Median seconds of a picture, each by another camera."""
    make(next(cameras))
    found = []
    for _ in range(rounds):
        camera, start = next(cameras), time.perf_counter()
        make(camera)
        found.append(time.perf_counter() - start)
    return statistics.median(found)


def compared(name: str, scene: Scene, true_samples: int, folder: Path | None) -> Row:
    """Render a scene by both in equal time."""
    scene = emission_only(scene)
    theirs, renderer = MitsubaSampled(scene), ldtrefl.Renderer(scene, "ldt")
    ours = seconds_of(renderer.render, moving(scene.camera), ROUNDS)
    samples, their_seconds = 1, seconds_of(lambda camera: theirs.picture(camera, 1), moving(scene.camera), ROUNDS)
    for count in theirs.counts():
        more = seconds_of(functools.partial(theirs.picture, samples=count), moving(scene.camera), ROUNDS)
        if more > ours:
            break
        samples, their_seconds = count, more
    frame, truth = renderer.render(scene.camera), theirs.truth(scene.camera, true_samples)
    picture = theirs.picture(scene.camera, samples)
    if folder not in (None, RESULTS):
        for kind, image in (("ours", frame.image), ("mitsuba", picture), ("truth", truth)):
            ldtrefl.save_image(folder / f"{name}-{kind}.png", image)
    mean = float(frame.sample_counts.mean())
    error, their_error = (flip(image, truth, np.ones(truth.shape[:2], bool)) for image in (frame.image, picture))
    return Row(name, 1000 * ours, mean, error, 1000 * their_seconds, samples, their_error)


def table(rows: list[Row]) -> str:
    """The figures in Markdown."""
    names = ["scene", "ours, ms", "samples", "FLIP", "Mitsuba, ms", "samples", "FLIP", "ours / Mitsuba's", ""]
    lines = [f"| {' | '.join(names)} |", "|" + "---|" * len(names)]
    for row in rows:
        cells = [row.scene, f"{row.milliseconds:.1f}", f"{row.samples:.2f}", f"{row.error:.4f}"]
        cells += [f"{row.their_milliseconds:.1f}", f"{row.their_samples}", f"{row.their_error:.4f}"]
        cells += [f"{row.error / row.their_error:.2f}", "" if row.passed else "**beyond**"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


EXPLANATION = f"""\
Versions of the shipped scenes in which every surface radiates its emission and its albedo times texture, and mirrors
reflect: there are no lights. Ours is `ldt` as it is by default (`samples = 4`, adaptive, quality `balanced`), with its
*samples* of a pixel in the mean. Mitsuba is `path` (`llvm_ad_rgb`, sampler `multijitter`) with as many samples as take
no longer than ours, or one. Times are medians of {ROUNDS} frames with a moving camera, from the call to numpy's
picture, all that is compiled left out. Both filter by a Gaussian of standard deviation {DEVIATION} pixels that ends at
four of these. FLIP is that of what is shown, over the whole image, against {TRUE_SAMPLES} samples by Mitsuba; ours may
be {MOST_SHARE:g} of Mitsuba's.
"""


def main() -> int:
    """Compare the scenes that are wanted, and write the report."""
    given = arguments(__doc__, SCENES, "small pictures, and a truth of few samples")
    version = mitsuba().__version__
    rows = []
    for name in given.only or SCENES:
        scene = ldtrefl.load_scene(ROOT / "scenes" / f"{name}.toml")
        if given.quick:
            width, height = QUICK_SIZE
            scene = scene.with_camera(dataclasses.replace(scene.camera, width=width, height=height))
        rows.append(compared(name, scene, SAMPLES_AT_ONCE if given.quick else TRUE_SAMPLES, given.output))
        print(f"{name}: {rows[-1].error / rows[-1].their_error:.2f}", flush=True)
    beyond = sum(not row.passed for row in rows)
    head = f"{len(rows)} scenes, {beyond} beyond the limit; Mitsuba {version}."
    write_report(
        given.output, "equal_time", f"# Pictures in equal time\n\n{head}\n\n{EXPLANATION}\n{table(rows)}", rows
    )
    return 1 if beyond else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except InputError as error:
        sys.exit(f"equal_time.py: {error}")
