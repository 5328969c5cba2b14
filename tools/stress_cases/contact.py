"""Case 5: an object close to its mirror, touching it, overlapping it, and resting on it over an area."""

from __future__ import annotations

import ldtrefl

from .outcomes import Outcome
from .pictures import judge_reflections

NAME = "5 contact"
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
    return outcomes


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
