"""Frames of ours by any checkout of the package, in a process of its own.

The process runs this file with the checkout's package, and makes a frame when it is asked to by a line.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import ldtrefl

from .frame_scenes import frame_scene
from .our_frames import OurFrames

SECONDS = 30.0
"""That a process has to end once its input has."""


def environment_of(checkout: Path) -> dict[str, str]:
    """The environment of a process that imports the package of a checkout, and all else as this one does."""
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(checkout), *filter(None, sys.path)])}


class CheckoutFrames:
    """Frames of the scene called ``name`` by the package in the folder ``checkout``.

    Raises:
        ldtrefl.InputError: the process ends, or has another package.
    """

    def __init__(self, checkout: Path, name: str, size: tuple[int, int] | None, method: str, threads: int) -> None:
        """Make the first frame."""
        self._checkout = checkout.resolve()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmark_parts.checkout_frames", json.dumps([name, size, method, threads])],
            env=environment_of(self._checkout),
            cwd=self._checkout,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        told = self._answer()
        if not Path(told["package"]).is_relative_to(self._checkout):
            self.__exit__()
            raise ldtrefl.InputError(f"{checkout} is no checkout of the package: {told['package']} is imported there")
        self.first: float = told["first"]
        self.stages: dict[str, float] = {}
        """Seconds of each stage of the last frame that ``frame`` made."""

    def __enter__(self) -> CheckoutFrames:
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(SECONDS)
        self._process.stdout.close()

    def frame(self) -> float:
        """Seconds of the next frame."""
        assert self._process.stdin is not None
        self._process.stdin.write("frame\n")
        self._process.stdin.flush()
        told = self._answer()
        self.stages = told["stages"]
        return float(told["seconds"])

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self.__exit__()
            raise ldtrefl.InputError(f"{self._checkout} makes no frames: its process has ended")
        return dict(json.loads(line))


def _serve(name: str, size: tuple[int, int] | None, method: str, threads: int) -> None:
    """Make the first frame, and another for every line that comes in."""
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever else is printed is no answer
    scene = frame_scene(name, size)
    for entry in scene.objects:
        _ = entry.geometry  # made outside the clock
    frames = OurFrames(scene, method, threads)
    print(json.dumps({"package": ldtrefl.__file__, "first": frames.first}), file=answers)
    for _line in sys.stdin:
        seconds = frames.frame()
        print(json.dumps({"seconds": seconds, "stages": frames.stages}), file=answers)


if __name__ == "__main__":
    _serve(*json.loads(sys.argv[1]))
