"""Estalella et al., "A GPU-driven algorithm for accurate interactive reflections on curved objects" (2006): Table 1."""

from __future__ import annotations

import statistics
from dataclasses import dataclass

from ldtrefl.renderer import Renderer
from ldtrefl.scene.description import Scene

from .scenes import approach, eight_eyes, paper_scene
from .table import GEFORCE_7800, Cell, Table

FRAMES = 120
QUICK_FRAMES = 6
COLD_FRAMES = 4
"""Frames, on the same way, of the searches that are not coherent."""

FASTER = 4
"""How many times as far the camera also moves from frame to frame."""

SHARES = (1.4, 0.6)
"""How many times as far from its target the camera is at first and at last: it moves towards the reflector, as theirs
does, which covers a large part of the picture at the end."""

FINENESS = 1.0
"""Texels along a pixel: their textures are drawn by the observer's own camera."""

ALLOWED = 1.5
"""How many times the paper's mean iterations ours may be."""

TABLE_1 = {"kitchen": (14.9, 4.7), "UFO": (71.2, 4.2), "ant": (7.5, 3.3)}
"""The paper's maximum frame average and total average."""


@dataclass(frozen=True)
class Lengths:
    """How long the searches along a way were."""

    first: float
    """Mean iterations of the first frame."""
    longest: float
    """Of the frames after it, the largest mean."""
    mean: float
    """The mean over all frames."""


def lengths(scene: Scene, frames: int, *, coherent: bool = True) -> Lengths:
    """Move the camera towards what it looks at."""
    renderer = Renderer(scene, "bisector", samples=1, coherent=coherent, fineness=FINENESS)
    means = []
    for camera in approach(scene.camera, SHARES, frames):
        counters = renderer.render(camera).stats.counters
        means.append(counters["steps"] / counters["vertices"])
    return Lengths(means[0], max(means[1:]), statistics.mean(means))


def tables(quick: bool) -> list[Table]:
    """Table 1, on the kitchen and on a scene with eight reflectors, and on the kitchen with a faster camera."""
    frames = QUICK_FRAMES if quick else FRAMES
    kitchen, eyes = paper_scene("paper/kitchen", quick), eight_eyes(quick)
    faster = max(2, frames // FASTER)
    rows = [
        ["kitchen", *TABLE_1["kitchen"], *_ours(kitchen, frames, TABLE_1["kitchen"][1])],
        [f"kitchen, {FASTER} times as fast", None, None, *_ours(kitchen, faster, None)],
        ["UFO", *TABLE_1["UFO"], *[None] * 7, "no such scene here"],
        ["ant", *TABLE_1["ant"], *_ours(eyes, frames, TABLE_1["ant"][1])],
    ]
    text = (
        f"`bisector` with `coherent = true` and {FINENESS:g} texel a pixel, pictures of 768 x 512. The camera comes "
        f"nearer to the reflector, from {SHARES[0]:g} to {SHARES[1]:g} times the scene's distance. How far theirs "
        "moves from frame to frame and how large their pictures are is not said, and both decide. Iterations are "
        "neighbourhoods that are looked at, a mean over all vertices of a frame. Their kitchen has 14,979 vertices, "
        "their ant scene 30,153 and eight reflectors; ours of eight is the kitchen with eight small balls. In our "
        "first frame all searches begin in the middle of the reflector, as they do in all frames without `coherent`; "
        f"the other means are of the frames after it and of all. Our total average may be {ALLOWED:g} times theirs."
    )
    columns = ["scene", "theirs: max frame average", "total average", "our vertices", "frames", "ours: first frame"]
    columns += ["max frame average", "total average", "ours / theirs", "not coherent", ""]
    return [Table("Estalella et al., Table 1: iterations of a search", GEFORCE_7800, text, columns, rows)]


def _ours(scene: Scene, frames: int, theirs: float | None) -> list[Cell]:
    """Our cells of a row; ``theirs`` is the paper's total average."""
    count = sum(len(each.geometry.vertices) for each in scene.objects if not each.is_reflector)
    found = lengths(scene, frames)
    cold = lengths(scene, COLD_FRAMES, coherent=False)
    ratio = None if theirs is None else found.mean / theirs
    verdict = "" if ratio is None else "within" if ratio <= ALLOWED else "**beyond**"
    return [count, frames, found.first, found.longest, found.mean, ratio, cold.mean, verdict]
