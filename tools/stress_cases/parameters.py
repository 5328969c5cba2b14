"""Case 8: map resolutions from 16 to 4096, any number of steps, objects as thin as a texel."""

from __future__ import annotations

import time

import ldtrefl
from ldtrefl.scene import shapes

from .inputs import moved, rays_about
from .judge import judge, judge_mesh
from .outcomes import LINEAR, Limit, Outcome, describe, limits, linear_limit
from .truth import Truth

NAME = "8 parameters"
ANY = limits(linear=linear_limit(100.0, "a texel may be as large as the object: finite answers alone"))
THIN = limits(
    Limit(place=1.0, wrong=0.5, why="a ten-thousandth as high as wide: barycentrics are those of a rounded position"),
    linear=ANY["linear"],
)


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` rays for each setting."""
    knot = shapes.make("torus_knot", {"segments": [96, 16]})
    origins, directions = rays_about(knot, rays, 80)
    outcomes = []
    for resolution in (16, 17, 37, 128, 1024, 4096):
        outcomes += judge_mesh(NAME, f"resolution {resolution}", knot, origins, directions, ANY, resolution)
    for name, shape in (("one texel thick", (1.0, 1.0, 1e-4)), ("one texel wide", (1e-4, 1e-4, 1.0))):
        thin = moved(knot, shape)
        outcomes += judge_mesh(NAME, f"{name}, resolution 16", thin, *rays_about(thin, rays, 81), THIN, 16)
    truth = Truth(knot)
    true_t = truth.hits(origins, directions)
    maps = ldtrefl.peel(knot.vertices, knot.faces, search="linear")
    for linear, binary in ((1, 0), (1, 64), (16, 8), (512, 0), (512, 8), (10_000, 8)):
        start = time.perf_counter()
        hits = maps.trace(origins, directions, search="linear", linear_steps=linear, binary_steps=binary)
        held_to = LINEAR if linear >= 512 else ANY["linear"]
        outcome = judge(truth, origins, directions, true_t, hits, held_to)
        outcome.case, outcome.what, outcome.by = NAME, f"{linear} linear and {binary} binary steps", "linear"
        outcome.seconds, outcome.limit = time.perf_counter() - start, describe(held_to)
        outcomes.append(outcome)
    return outcomes
