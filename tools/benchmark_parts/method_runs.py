"""The runs of the benchmark's error against time: every method, with parameters by which time and error change.

``tessellation`` is always free of cracks. As it leaves triangles alone that are smaller than a pixel, it has the knot
in a coarse form, too, in which it divides what the mirror bends.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from ldtrefl.ldt.options import DEFAULT_RESOLUTION
from ldtrefl.methods import find_method
from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Scene

from .common import SKIPS_BUT_FRAMES, knot_scene, wall_scene

BALL, WALL = "mirror ball and torus knot", "flat mirror and torus knot"
SCENES = {BALL: knot_scene, WALL: wall_scene}

PROJECTIONS = ("infinite", "sphere", "box", "distance", "layered")
"""Of ``envmap``."""

FULL, QUICK = (2000, 125), (200, 25)
"""Segments of the knot: 500,000 triangles, and 10,000."""
COARSE = (100, 12)
"""Segments of the knot that ``tessellation`` takes to pieces."""

Options = Mapping[str, str | float]
"""Of a method, as a renderer takes them."""


@dataclasses.dataclass(frozen=True)
class Run:
    """One method with its parameters, on one scene."""

    scene: str
    curve: str
    label: str
    """The parameter."""
    method: str
    options: Options
    segments: tuple[int, int]
    """Of the knot."""
    is_usual: bool = False
    """Whether the parameter is the one that the method has if none is given."""

    def scene_of(self, width: int, height: int) -> Scene:
        """The scene in an image of this size."""
        return SCENES[self.scene](self.segments, width, height)

    def renderer(self, width: int, height: int) -> Renderer:
        """A renderer of the scene, whose every frame is made anew."""
        return Renderer(
            self.scene_of(width, height), self.method, None, skip=SKIPS_BUT_FRAMES, **self.options, samples=1
        )


def every_run(quick: bool) -> list[Run]:
    """All runs: on a ball those methods that take curved mirrors, on a wall those that take flat ones."""
    segments = QUICK if quick else FULL
    return [*_traced(segments, quick), *_cube_maps(segments, quick), *_virtual(segments, quick), *_flat(segments)]


def _traced(segments: tuple[int, int], quick: bool) -> list[Run]:
    """Of methods that search along rays."""
    runs = [Run(BALL, "bvh", "full mesh", "bvh", {}, segments, True)]
    for columns, rows in [(40, 8), COARSE, (200, 25), (600, 80)][: 2 if quick else 4]:
        runs.append(Run(BALL, "bvh, decimated", _triangles(columns, rows), "bvh", {}, (columns, rows)))
    for resolution in (64, 256) if quick else (32, 64, 128, 256, 512):
        options, label = {"resolution": resolution}, f"{resolution}"
        runs.append(Run(BALL, "ldt balanced", label, "ldt", options, segments, resolution == DEFAULT_RESOLUTION))
        runs.append(Run(BALL, "ldt fast", label, "ldt", options | {"quality": "fast"}, segments))
    runs.append(Run(BALL, "ldt exact", "every triangle", "ldt", {"quality": "exact"}, segments))
    for steps in (32, 256) if quick else (16, 32, 64, 128, 256, 512, 1024):
        searched = {"search": "linear", "linear_steps": steps}
        runs.append(Run(BALL, "ldt linear", f"{steps} steps", "ldt", searched, segments))
    return runs


def _cube_maps(segments: tuple[int, int], quick: bool) -> list[Run]:
    """Of ``envmap``."""
    runs = []
    for projection in PROJECTIONS:
        for resolution in (64, 512) if quick else (64, 128, 256, 512, 1024):
            runs.append(_cube_map(BALL, projection, resolution, segments))
    return runs


def _cube_map(scene: str, projection: str, resolution: int, segments: tuple[int, int]) -> Run:
    options: Options = {"resolution": resolution, "projection": projection}
    usual = _are_usual("envmap", {"resolution": resolution})
    return Run(scene, f"envmap {projection}", f"{resolution}", "envmap", options, segments, usual)


def _virtual(segments: tuple[int, int], quick: bool) -> list[Run]:
    """Of methods that move vertices to where the mirror shows them."""
    swept: list[tuple[str, str, str, tuple[float, ...]]] = [
        ("fermat", "resolution", "{:g}", (16, 128) if quick else (8, 16, 32, 64, 128, 256, 512)),
        ("fermat-uv", "steps", "{:g} steps", (2, 5) if quick else (2, 3, 4, 5, 6)),
        ("bisector", "fineness", "{:g} texels a pixel", (0.5, 2.0) if quick else (0.5, 1.0, 2.0, 4.0, 8.0)),
    ]
    runs = []
    for method, option, label, values in swept:
        for value in values:
            options = {option: value}
            runs.append(Run(BALL, method, label.format(value), method, options, segments, _are_usual(method, options)))
    usual = find_method("tessellation").options()["threshold"][0]
    label = f"threshold {usual:g}"
    runs.append(Run(BALL, "tessellation", label, "tessellation", {"crack_free": True}, segments, True))
    for threshold in (0.01, usual) if quick else (0.05, 0.01, 0.002, usual, 0.0001):
        divided = {"crack_free": True, "threshold": threshold}
        label = f"threshold {threshold:g}, {_triangles(*COARSE)}"
        runs.append(Run(BALL, "tessellation, decimated", label, "tessellation", divided, COARSE))
    return runs


def _flat(segments: tuple[int, int]) -> list[Run]:
    """Of a flat mirror."""
    runs = [
        Run(WALL, "bvh", "full mesh", "bvh", {}, segments, True),
        Run(WALL, "ldt balanced", f"{DEFAULT_RESOLUTION}", "ldt", {}, segments, True),
        Run(WALL, "planar", "-", "planar", {}, segments, True),
    ]
    return runs + [_cube_map(WALL, projection, 512, segments) for projection in PROJECTIONS]


def _are_usual(method: str, options: Options) -> bool:
    """Whether options have the values that a method has without them."""
    usual = find_method(method).options()
    return all(usual[name][0] == value for name, value in options.items())


def _triangles(columns: int, rows: int) -> str:
    return f"{2 * columns * rows} triangles"
