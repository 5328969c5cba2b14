"""Case 2: rays along axes, in planes, through corners and edges, grazing, and with directions of any length or none."""

from __future__ import annotations

import numpy as np

import ldtrefl
from ldtrefl.scene import shapes

from .inputs import rays_about, tracers
from .judge import judge_mesh
from .outcomes import TEXELS, Limit, Outcome, limits, linear_limit

NAME = "2 directions"
GRAZING = limits(
    Limit(
        wrong=100.0,
        p99=np.inf,
        p999=0.06,
        why="a ray at 89.9999 degrees moves 600,000 times as far as it is moved aside",
    ),
    linear=linear_limit(100.0, "the same, by a texel: finite answers alone"),
)
AIMED_SHARE = 20.0
"""Percent of the rays aimed at vertices and edges that are aimed at a silhouette, where hit or miss is chance."""

AIMED = limits(
    Limit(wrong=AIMED_SHARE, p99=np.inf, why="a hit or a miss at a silhouette's vertex is chance"),
    linear=linear_limit(AIMED_SHARE, "aimed at silhouettes' corners, which are blocks of a texel"),
)
"""For rays aimed at vertices and edges as exactly as float32 can."""


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` rays of each kind."""
    box, knot = shapes.make("box", {"segments": 4}), shapes.make("torus_knot", {"segments": [96, 16]})
    outcomes = []
    for mesh, name in ((box, "box"), (knot, "knot")):
        for zero in (0.0, -0.0, 1e-30, -1e-42):
            outcomes += judge_mesh(
                NAME, f"{name}, along axes, other components {zero:g}", mesh, *axis_rays(mesh, rays, zero)
            )
        outcomes += judge_mesh(NAME, f"{name}, through texel corners", mesh, *texel_rays(mesh, rays))
        outcomes += judge_mesh(NAME, f"{name}, through vertices", mesh, *rays_to(mesh, mesh.vertices, rays), AIMED)
        edges = (mesh.vertices[mesh.faces[:, 0]] + mesh.vertices[mesh.faces[:, 1]]) / 2
        outcomes += judge_mesh(NAME, f"{name}, through edges", mesh, *rays_to(mesh, edges, rays), AIMED)
        for length in (1e-20, 1e-3, 1e10, 1e20):
            origins, directions = rays_about(mesh, rays, 4)
            outcomes += judge_mesh(
                NAME, f"{name}, directions of length {length:g}", mesh, origins, directions * np.float32(length)
            )
    outcomes += judge_mesh(NAME, "box, in the planes of its sides", box, *plane_rays(rays), GRAZING)
    for degrees in (89.9, 89.99, 89.999, 89.9999):
        outcomes += judge_mesh(NAME, f"box, grazing at {degrees}", box, *grazing_rays(rays, degrees), GRAZING)
    return outcomes + no_rays(knot, rays)


def axis_rays(mesh: ldtrefl.Mesh, count: int, other: float) -> tuple[np.ndarray, np.ndarray]:
    """Rays along +-x, +-y, +-z through the box, the other components ``other``."""
    rng = np.random.default_rng(5)
    axis, sign = rng.integers(0, 3, count), rng.choice([-1.0, 1.0], count)
    origins = rng.uniform(mesh.bounds[0], mesh.bounds[1], (count, 3))
    directions = np.full((count, 3), other)
    directions[np.arange(count), axis] = sign
    origins[np.arange(count), axis] = -4 * sign
    return origins, directions


def texel_rays(mesh: ldtrefl.Mesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Axis-parallel and diagonal rays that run exactly along the borders of texels of a 256 map."""
    rng = np.random.default_rng(6)
    low, high = mesh.bounds
    texel = (high - low).max() / TEXELS
    middle = (low + high) / 2
    points = middle + texel * rng.integers(-100, 101, (count, 3))
    directions = rng.integers(-1, 2, (count, 3)).astype(float)
    directions[~directions.any(axis=1)] = (1, 0, 0)
    return points - 4 * directions, directions


def rays_to(mesh: ldtrefl.Mesh, targets: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from about the mesh to given points, aimed as exactly as float32 can."""
    rng = np.random.default_rng(7)
    origins, _ = rays_about(mesh, count, 8)
    chosen = targets[rng.integers(0, len(targets), count)]
    return origins, chosen - origins


def plane_rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays that run in the planes of the sides of the box from -1 to 1."""
    rng = np.random.default_rng(9)
    origins, directions = rng.uniform(-3, 3, (count, 3)), rng.normal(size=(count, 3))
    axis = rng.integers(0, 3, count)
    origins[np.arange(count), axis] = rng.choice([-1.0, 1.0], count)
    directions[np.arange(count), axis] = 0.0
    return origins, directions


def grazing_rays(count: int, degrees: float) -> tuple[np.ndarray, np.ndarray]:
    """Rays at ``degrees`` from the normal of the top of the box, towards points of it."""
    rng = np.random.default_rng(10)
    targets = np.column_stack([rng.uniform(-1, 1, (count, 2)), np.ones(count)])
    around = rng.uniform(0, 2 * np.pi, count)
    elevation = np.radians(90 - degrees)
    directions = np.column_stack([np.cos(around), np.sin(around), np.full(count, -np.tan(elevation))])
    return targets - 0.7 * directions, directions


def no_rays(mesh: ldtrefl.Mesh, count: int) -> list[Outcome]:
    """Zero, infinite and NaN rays are misses and are counted; the good rays among them are answered as without them."""
    origins, directions = rays_about(mesh, max(count, 64), 11)
    origins, directions = origins.copy(), directions.copy()
    bad = np.arange(0, len(origins), 2)
    for i, value in zip(bad, [0.0, np.nan, np.inf, -np.inf] * len(bad), strict=False):
        (directions if (i // 2) % 3 or value == 0.0 else origins)[i] = value
    outcomes = []
    for by, trace in tracers(mesh):
        hits = trace(origins, directions)
        alone = trace(origins[1::2], directions[1::2])
        outcome = Outcome(NAME, "zero, infinite and NaN rays", by, tried=len(origins))
        outcome.wrong_hits = int((hits.triangle[bad] >= 0).sum())
        outcome.non_finite = int(np.isnan(hits.t).sum())
        outcome.limit = "all are misses, all are counted, the rays among them keep their bits"
        undisturbed = np.array_equal(hits.t[1::2], alone.t) and np.array_equal(hits.triangle[1::2], alone.triangle)
        outcome.passed = outcome.wrong_hits == 0 and hits.invalid == len(bad) and undisturbed
        outcomes.append(outcome)
    return outcomes
