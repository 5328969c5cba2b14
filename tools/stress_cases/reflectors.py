"""Case 7: mirrors of one triangle, faceted, tiny and bent, hollow, and with useless normals."""

from __future__ import annotations

import numpy as np

import ldtrefl
from ldtrefl.scene import shapes

from .outcomes import Outcome
from .pictures import Held, judge_reflections, surroundings

NAME = "7 reflectors"
MIRROR = ldtrefl.Material(albedo=(0.05,) * 3, mirror=(0.9,) * 3)
HELD = {
    "strongly bent under one pixel": Held(linear_percent=5.0, reflector=0.01),
    "hollow": Held(linear_percent=5.0, linear_off=8.0),
    "a saddle with several reflections of a point": Held(linear_percent=5.0, linear_off=8.0),
    # Smaller than the distance between pixels' centres, so that no pixel sees it.
    "a tenth of a pixel": Held(reflector=0.0, hits=0.0),
}


def run(rays: int, pictures: int) -> list[Outcome]:
    """Pictures of ``pictures`` pixels a side."""
    ball = shapes.make("sphere", {"segments": [48, 24]})
    spoilt = ball.normals.copy()
    spoilt[::3], spoilt[1::7], spoilt[2::11] = 0.0, -spoilt[1::7], 1e-30
    away = -ball.normals
    mirrors = {
        "one triangle": ldtrefl.Mesh(np.array([[-1, 0.2, -1], [1, 0, -1], [0, 0, 1]]), np.array([[0, 1, 2]])),
        "faceted": shapes.make("sphere", {"segments": [10, 6]}),
        "strongly bent under one pixel": shapes.make("torus", {"minor": 0.01, "segments": [64, 16]}),
        "hollow": shapes.make("bowl"),
        "a saddle with several reflections of a point": shapes.make("gyroid", {"grid": 24}),
        "zero, turned and tiny vertex normals": ldtrefl.Mesh(ball.vertices, ball.faces, spoilt),
        "normals that point inwards": ldtrefl.Mesh(ball.vertices, ball.faces, away),
        "a tenth of a pixel": ball,
    }
    outcomes = []
    for what, mesh in mirrors.items():
        scale = 1e-3 if what == "a tenth of a pixel" else 1.0
        for smooth in (True, False):
            scene = ldtrefl.Scene(
                camera=ldtrefl.Camera(
                    eye=(0.7, -5, 1.2), look_at=(0.4, 0, 0), fov_y=35.0, width=pictures, height=pictures
                ),
                objects=(
                    ldtrefl.Object(mesh=mesh, smooth=smooth, scale=scale, rotate=(1, 0, 0, 60), material=MIRROR),
                    ldtrefl.Object(
                        shape="torus_knot", params={"segments": [96, 16]}, scale=0.6, translate=(1.5, -1.4, 0.1)
                    ),
                    surroundings(),
                ),
            )
            shading = "smooth" if smooth else "faceted"
            outcomes += judge_reflections(NAME, f"{what}, {shading}", scene, HELD.get(what, Held(linear_percent=5.0)))
    return outcomes
