"""Case 6: cameras inside the reflector, on a surface, very wide and very narrow, of one pixel, and nearly along up."""

from __future__ import annotations

from typing import Any

import numpy as np

import ldtrefl

from .outcomes import Outcome
from .pictures import Held, judge_reflections, surroundings

NAME = "6 cameras"
MIRROR = ldtrefl.Material(albedo=(0.05,) * 3, mirror=(0.9,) * 3)
HELD = {
    "inside the mirror ball": Held(linear_percent=5.0, linear_off=4.0),
    # Whether an eye on the surface sees it or what lies behind it is decided by rounding: pictures must be finite.
    "on the mirror ball": Held(percent=100.0, linear_percent=100.0, lost=1.0),
    "inside the object": Held(reflector=0.0, hits=0.0),
    "looking away": Held(reflector=0.0, hits=0.0),
    # So wide that the ball is small although the eye all but touches it.
    "field of view 170": Held(linear_percent=5.0, reflector=0.02),
    "field of view 179": Held(linear_percent=5.0, reflector=0.003),
    # One ray, or many that are all but one: all of them meet the room.
    "field of view 0.01": Held(linear_percent=5.0, hits=1.0),
    "1 x 1": Held(linear_percent=5.0, hits=1.0),
}


def run(rays: int, pictures: int) -> list[Outcome]:
    """Pictures of ``pictures`` pixels a side."""
    n, wide = pictures, min(4096, 16 * pictures)
    base: dict[str, Any] = {"eye": (0.7, -5.0, 1.0), "look_at": (0.6, 0.0, 0.0), "fov_y": 40.0, "width": n, "height": n}
    cameras = {
        "inside the mirror ball": {**base, "eye": (0.1, 0.2, 0.1), "look_at": (1.0, 0.3, 0.2), "fov_y": 100.0},
        "on the mirror ball": {**base, "eye": (0.0, -1.0, 0.0), "look_at": (1.0, -1.2, 0.0), "fov_y": 100.0},
        "a hair off the mirror ball": {**base, "eye": (0.0, -1.001, 0.0), "look_at": (1.0, -1.2, 0.0), "fov_y": 100.0},
        "inside the object": {**base, "eye": (1.75, -1.1, 0.05), "look_at": (0.0, 0.0, 0.0), "fov_y": 60.0},
        "field of view 0.01": {**base, "look_at": (0.0, -1.0, 0.0), "fov_y": 0.01},
        "field of view 170": {**base, "eye": (0.2, -1.08, 0.1), "look_at": (0.0, 0.0, 0.0), "fov_y": 170.0},
        "field of view 179": {**base, "eye": (0.02, -1.005, 0.01), "look_at": (0.0, 0.0, 0.0), "fov_y": 179.0},
        "1 x 1": {**base, "look_at": (0.2, 0.0, 0.3), "width": 1, "height": 1},
        "1 x 4096": {**base, "width": 1, "height": wide},
        "4096 x 1": {**base, "width": wide, "height": 1, "fov_y": float(np.degrees(2 * np.arctan(0.5 / wide)))},
        "nearly along up": {**base, "eye": (0.6, -0.5, 6.0), "look_at": (0.6, -0.5 + 1e-7, 0.0)},
        "looking away": {**base, "look_at": (0.7, -9.0, 1.0)},
    }
    outcomes = []
    for what, camera in cameras.items():
        scene = ldtrefl.Scene(
            camera=ldtrefl.Camera(**camera),
            objects=(
                ldtrefl.Object(shape="sphere", params={"segments": [64, 32]}, material=MIRROR),
                ldtrefl.Object(
                    shape="torus_knot", params={"segments": [96, 16]}, scale=0.7, translate=(1.5, -1.0, 0.1)
                ),
                surroundings(),
            ),
        )
        outcomes += judge_reflections(NAME, what, scene, HELD.get(what, Held(linear_percent=5.0)))
    return outcomes
