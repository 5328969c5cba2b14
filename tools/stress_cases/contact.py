"""Case 5: an object close to its mirror, touching it, overlapping it, and resting on it over an area; and mirrors that
touch: about the contact there are neither speckles nor rings of light, at any size."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import ldtrefl
from ldtrefl.scene.description import Scene

from .outcomes import Outcome
from .paths import Paths, paths_of
from .pictures import frames, judge_reflections, not_finite
from .touching import ASIDE, FAR_LARGER, TOUCHING, near_edges, touching

NAME = "5 contact"
OFF = 0.05
"""Radiance by which a pixel is off."""

LINEAR_PERCENT = 100.0
"""Percent of the pixels that may be off by the paper's search: it starts two texels and a half above a mirror, which is
a long way about a contact. Its pixels must be finite."""

LEAST_COMPARED = 0.3
"""Share of the pixels that must not be near an edge."""

BOUNCES = 4
SIZES = (1.0, 1e-4, 1e4)
CLOSE = 3.0
"""Degrees of a field of view that the contact fills."""

MIRROR = ldtrefl.Material(albedo=(0.05,) * 3, mirror=(0.9,) * 3)


def run(rays: int, pictures: int) -> list[Outcome]:
    """Pictures of ``pictures`` pixels a side."""
    outcomes = []
    for gap in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 0.0, -1e-3, -0.3):
        ball = ldtrefl.Object(shape="sphere", params={"segments": [48, 24]}, translate=(0.0, 0.0, 1.0 + gap))
        outcomes += judge_reflections(NAME, f"ball {gap:g} above a mirror", on_mirror(ball, pictures))
    for gap in (1e-3, 0.0, -1e-3):
        box = ldtrefl.Object(shape="box", scale=0.6, translate=(0.0, 0.0, 0.6 + gap), rotate=(0, 0, 1, 20))
        outcomes += judge_reflections(NAME, f"box {gap:g} above a mirror", on_mirror(box, pictures))
    for gap in (1e-2, 0.0, -1e-2):
        knot = ldtrefl.Object(
            shape="torus_knot", params={"segments": [96, 16]}, scale=0.7, translate=(1.7 + gap, -0.1, 0.0)
        )
        outcomes += judge_reflections(NAME, f"knot {gap:g} beside a mirror ball", beside_ball(knot, pictures))
    for what in TOUCHING:
        outcomes += judge_contact(what, pictures)
    return outcomes


def judge_contact(what: str, pixels: int) -> Iterator[Outcome]:
    """A contact from a distance and from close by, at every size, and on a floor that is far larger."""
    for fov, seen in ((28.0, ""), (CLOSE, ", close by")):
        scene = touching(what, pixels, fov=fov)
        paths = paths_of(scene, BOUNCES)
        near = near_edges(scene, paths)
        for size in SIZES:  # the truth has no size
            yield from judged(f"{what}{seen}, size {size:g}", touching(what, pixels, size=size, fov=fov), paths, near)
        if "mirror floor" in what:
            for aside, where in ((np.zeros(3), "the middle"), (ASIDE, "a side")):
                scene = touching(what, pixels, fov=fov, floor=FAR_LARGER, aside=aside)
                paths = paths_of(scene, BOUNCES)
                near = near_edges(scene, paths)
                yield from judged(f"{what}{seen}, a million times larger, at {where}", scene, paths, near)


def judged(what: str, scene: Scene, paths: Paths, near: np.ndarray) -> Iterator[Outcome]:
    """Pictures by every method against the truth, pixels ``near`` edges left out."""
    for by, frame, seconds in frames(scene):
        off = (np.abs(frame.image - paths.image).max(axis=2) > OFF) & ~near
        outcome = Outcome(NAME, what, by, tried=int((~near).sum()), disagree=int(off.sum()), seconds=seconds)
        allowed = LINEAR_PERCENT if by == "linear" else 0.0
        outcome.non_finite = not_finite(frame)
        outcome.limit = f"<= {allowed:g}% of the pixels a pixel off every edge are off by more than {OFF:g}"
        enough = (~near).mean() >= LEAST_COMPARED and frame.reflector_mask.any()
        outcome.passed = bool(enough) and outcome.non_finite == 0 and off.mean() <= allowed / 100.0
        yield outcome


def on_mirror(thing: ldtrefl.Object, pixels: int) -> ldtrefl.Scene:
    """An object over a flat mirror."""
    return ldtrefl.Scene(
        camera=ldtrefl.Camera(eye=(0.5, -5.0, 2.0), look_at=(0.0, 0.0, 0.3), fov_y=40.0, width=pixels, height=pixels),
        objects=(ldtrefl.Object(shape="plane", scale=3.0, material=MIRROR), thing),
    )


def beside_ball(thing: ldtrefl.Object, pixels: int) -> ldtrefl.Scene:
    """An object beside a mirror ball."""
    ball = ldtrefl.Object(shape="sphere", params={"segments": [64, 32]}, material=MIRROR)
    return ldtrefl.Scene(
        camera=ldtrefl.Camera(eye=(1.0, -5.0, 1.0), look_at=(0.7, 0.0, 0.0), fov_y=40.0, width=pixels, height=pixels),
        objects=(ball, thing),
    )
