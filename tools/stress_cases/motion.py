"""Case 10: a camera that moves by a tenth of a pixel a frame; nothing may flicker more than the truth does."""

from __future__ import annotations

import time

import numpy as np

import ldtrefl

from .outcomes import Outcome
from .pictures import METHODS, not_finite

NAME = "10 motion"
PERCENTILES = (50, 75, 90, 95, 99, 99.5, 99.9)
FRAMES = 60
ALLOWED = {"exact": 1.1, "balanced": 1.1, "fast": 2.0, "linear": 10.0, "bvh": 1.0}
"""How much a method's pictures may change from frame to frame, in times the truth's change, at every percentile. The
patches of ``fast`` and the paper's blocks of texels move in steps, so they flicker."""
MIRROR = 0.1
"""Least share of the pixels that must see the mirror."""
FLOOR = 1e-3
"""Radiance below which a change is not seen."""
ROUNDING = 1e-9
"""Of a ratio of two numbers that are the same."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """``FRAMES`` frames of ``pictures`` pixels a side, of knots of few and of many triangles."""
    outcomes = []
    for what, segments in (("knot of 3 k triangles", [96, 16]), ("knot of 375 k triangles", [1500, 125])):
        changes = {}
        for by, (method, options) in METHODS.items():
            start = time.perf_counter()
            renderer = ldtrefl.Renderer(scene(segments, 0, pictures), method, **options, samples=1)
            before, change, broken = None, [], 0
            for i in range(FRAMES):
                frame = renderer.render(camera=scene(segments, i, pictures).camera)
                broken += not_finite(frame)
                if before is not None:
                    mask = frame.reflector_mask & before.reflector_mask
                    change.append(np.abs(frame.image - before.image).max(axis=2)[mask])
                before = frame
            compared = np.concatenate(change)
            spread = np.percentile(compared, PERCENTILES)
            changes[by] = spread
            outcome = Outcome(NAME, what, by, tried=FRAMES * pictures * pictures, non_finite=broken)
            outcome.seconds = time.perf_counter() - start
            # A truth that hardly changes, or hardly shows the mirror, measures nothing.
            seen = len(compared) >= MIRROR * (FRAMES - 1) * pictures * pictures
            outcome.passed = seen and float(spread[PERCENTILES.index(99)]) > 10 * FLOOR
            outcomes.append(outcome)
        for outcome in outcomes[-len(METHODS) :]:
            ratio = (changes[outcome.by] / np.maximum(changes["bvh"], FLOOR)).max()
            outcome.worst = float(ratio)
            outcome.limit = f"change from frame to frame <= {ALLOWED[outcome.by]:g} times the truth's (shown as worst)"
            outcome.passed &= outcome.non_finite == 0 and ratio <= ALLOWED[outcome.by] + ROUNDING
    return outcomes


def scene(segments: list[int], frame: int, pixels: int) -> ldtrefl.Scene:
    """A mirror ball and a knot; the camera a tenth of a pixel aside for every frame."""
    pixel = 2 * 5.0 * np.tan(np.radians(18.0)) / pixels
    aside = 0.1 * pixel * frame
    return ldtrefl.Scene(
        camera=ldtrefl.Camera(
            eye=(-0.5 + aside, -5.0, 0.8), look_at=(0.3 + aside, 0.0, 0.0), fov_y=36.0, width=pixels, height=pixels
        ),
        lights=(ldtrefl.Light(kind="directional", direction=(0.3, 0.8, -0.7), radiance=(1.0, 1.0, 1.0)),),
        objects=(
            ldtrefl.Object(shape="sphere", material=ldtrefl.Material(albedo=(0.02,) * 3, mirror=(0.9,) * 3)),
            ldtrefl.Object(
                shape="torus_knot",
                params={"segments": segments},
                rotate=(1, 0.3, 0, 50),
                scale=0.75,
                translate=(1.2, -1.4, 0.1),
            ),
        ),
    )
