"""Whole frames of ours with a moving camera, and how long their stages take.

Other checkouts of the package make their frames by this file, too: it uses the public names alone.
"""

from __future__ import annotations

import statistics
import time

import ldtrefl
from ldtrefl.methods import find_method
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Scene

from .frame_scenes import moving

METHODS = ("ldt", "bvh")


class OurFrames:
    """Frames of a scene by one method, the renderer as it is by default."""

    def __init__(self, scene: Scene, method: str, threads: int) -> None:
        """Make the first frame."""
        self._threads, self._cameras = threads, moving(scene.camera)
        ldtrefl.set_threads(threads)
        start = time.perf_counter()
        takes_one = "samples" not in find_method(method).options()  # in older checkouts
        self._renderer = Renderer(scene, method) if takes_one else Renderer(scene, method, samples=1)
        self.picture = self._renderer.render().image
        """(h, w, 3) float32: the last frame; at first, the scene by its own camera."""
        self.first = time.perf_counter() - start
        """Seconds of the first frame, with all that is built and compiled for it."""
        self.stages: dict[str, float] = {}
        """Seconds of each stage of the last frame that ``frame`` made."""

    def frame(self) -> float:
        """Seconds of the next frame, from a camera that has moved to numpy's picture."""
        ldtrefl.set_threads(self._threads)
        camera = next(self._cameras)
        start = time.perf_counter()
        frame = self._renderer.render(camera=camera)
        seconds = time.perf_counter() - start
        self.picture = frame.image
        self.stages = dict(frame.stats.seconds)
        return seconds


def median_stages(frames: list[dict[str, float]]) -> dict[str, float]:
    """Median milliseconds of each stage, from the seconds that it took in each frame."""
    names = list(dict.fromkeys(name for frame in frames for name in frame))
    return {name: 1000 * statistics.median(frame.get(name, 0.0) for frame in frames) for name in names}
