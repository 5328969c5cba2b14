"""Memory of a reflection method: what a process grows by when it makes a renderer and two frames.

The process has the scene's meshes, and has made small frames by the same method before, so that code and pools are not
counted. What all methods need, such as the meshes on the device and the image, is.
"""

from __future__ import annotations

import dataclasses
import json
import sys

from ldtrefl.frame.result import Frame
from ldtrefl.renderer import Renderer

from .growth import give_back, growth_in_own_process, growth_of
from .method_runs import Run
from .result import Memory

SMALL_SIZE, SMALL_SEGMENTS = (96, 64), (40, 8)
"""Of the frames that a process makes first."""


def memory_of_run(run: Run, size: tuple[int, int]) -> Memory:
    """Bytes kept, and at the peak, of a run with frames of this size."""
    return growth_in_own_process("method_memory", json.dumps([dataclasses.asdict(run), size]))


def _growth(run: Run, size: tuple[int, int]) -> Memory:
    """What this process grows by when it makes the frames of a run."""
    _frames(dataclasses.replace(run, segments=SMALL_SEGMENTS), SMALL_SIZE)
    kept_meshes = [entry.geometry for entry in run.scene_of(*size).objects]
    found = growth_of(lambda: _frames(run, size))
    del kept_meshes
    return found


def _frames(run: Run, size: tuple[int, int]) -> tuple[Renderer, list[Frame]]:
    """A renderer, and two frames of it; what they needed meanwhile is given back."""
    renderer = run.renderer(*size)
    frames = [renderer.render() for _ in range(2)]
    give_back()
    return renderer, frames


if __name__ == "__main__":
    values, image_size = json.loads(sys.argv[1])
    print(json.dumps(_growth(Run(**values | {"segments": tuple(values["segments"])}), tuple(image_size))))
