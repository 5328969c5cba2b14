"""Case 18: one triangle far outside its mesh, and a city of boxes whose sizes span six decades, against float64.

Distances and radii are in sizes of what a picture would show: of the mesh's bulk where there is an outlier, and of the
whole city, whose smallest boxes are a few roundings of a float32 wide.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

import ldtrefl
from ldtrefl.scene import shapes

from .outcomes import TEXELS, Outcome
from .truth import brute_force

NAME = "18 outliers"
KNOT = {"segments": [64, 16]}
KINDS = ("beside", "ground", "dust")

EXACT = 1e-4
"""Of the bulk's size, how far a hit may lie off the surface that is truly hit."""
BESIDE = 4e-6
"""Of the bulk's size, how far from an edge a ray may pass and be answered otherwise: float32 at eight sizes."""
FLOAT32 = 4.8e-7
"""Relative rounding of a float32, eight times: of the distance, of the direction's length and of its unit vector."""
TIE = 4e-7
"""Of a city's size, how far from an edge a ray may pass and be answered otherwise: a few roundings of a float32."""
MOVED = 200
"""Rays about one, to find an edge near it: of 40 it happens that none passes on the other side of a corner."""
TIE_SLACK = 5.0
"""Times ``TIE``, how far along the ray the answer to a ray beside it may lie: surfaces are seen at an angle."""
KNOT_HITS, CITY_HITS = 0.2, 0.5
"""Least shares of the rays that must truly hit."""

Trace = Callable[[np.ndarray, np.ndarray], ldtrefl.Hits]


def run(rays: int, pictures: int) -> list[Outcome]:
    """``rays`` rays a mesh."""
    outcomes = []
    for kind in KINDS:
        for size in (1e1, 1e2, 1e3, 1e4, 1e5, 1e6):
            mesh = with_outlier(kind, size)
            for what, distance in (("near", 2.0), ("from beyond", 2.0 * size)):
                origins, directions = rays_to_knot(rays, distance, int(size))
                true_t, _ = brute_force(mesh, origins, directions)
                for by, trace in tracers(mesh):
                    outcome = Outcome(NAME, f"{kind}, {size:g} sizes, {what}", by, tried=len(origins))
                    start = time.perf_counter()
                    outcomes.append(
                        judge_outlier(outcome, mesh, trace(origins, directions), true_t, origins, directions)
                    )
                    outcome.seconds = time.perf_counter() - start
    mesh, half, middle = city(10_000)
    origins, directions = rays_to_boxes(rays, half, middle)
    for by, trace in tracers(mesh):
        outcome = Outcome(NAME, "a city of 10,000 boxes of sizes over six decades", by, tried=len(origins))
        outcomes.append(judge_city(outcome, mesh, half, middle, trace(origins, directions), origins, directions))
    return outcomes


def tracers(mesh: ldtrefl.Mesh) -> Iterator[tuple[str, Trace]]:
    """(name, trace) of what must be exact."""
    yield "exact", ldtrefl.peel(mesh.vertices, mesh.faces, quality="exact").trace
    yield "balanced", ldtrefl.peel(mesh.vertices, mesh.faces).trace
    yield "bvh", ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace


def with_outlier(kind: str, size: float) -> ldtrefl.Mesh:
    """A knot of size 2 and one triangle: far away and large, a large ground below it, or far away and small."""
    corners = {
        "beside": [[size, 0, 0], [size, size, 0], [size, 0, size]],
        "ground": [[-size, -size, -1.2], [size, -size, -1.2], [0, size, -1.2]],
        "dust": [[size, 0, 0], [size + 0.1, 0.1, 0], [size, 0, 0.1]],
    }[kind]
    knot = shapes.make("torus_knot", KNOT)
    n = len(knot.vertices)
    return ldtrefl.Mesh(np.vstack([knot.vertices, corners]), np.vstack([knot.faces, [[n, n + 1, n + 2]]]))


def rays_to_knot(count: int, distance: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) float32 origins so far from the knot's middle, and directions to points of its box."""
    rng = np.random.default_rng(seed)
    around = rng.normal(size=(count, 3))
    origins = (distance * around / np.linalg.norm(around, axis=1, keepdims=True)).astype(np.float32)
    return origins, (rng.uniform(-1, 1, origins.shape) - origins).astype(np.float32)


def judge_outlier(
    outcome: Outcome,
    mesh: ldtrefl.Mesh,
    hits: ldtrefl.Hits,
    true_t: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
) -> Outcome:
    """The same rays hit as truly do, and hits lie within ``EXACT`` of the surface. Any other answer must be true of a
    ray within ``BESIDE`` of the one that was traced."""
    hit, true = hits.triangle >= 0, np.isfinite(true_t)
    both = hit & true
    # Off the surface, not along the ray: from a million sizes away a grazing ray's rounding is long.
    towards = np.abs((hits.normal[both].astype(float) * directions[both]).sum(axis=1))
    error = np.maximum(np.abs(hits.t[both] - true_t[both]) - FLOAT32 * true_t[both], 0.0) * towards
    wrong = hit != true
    wrong[both] = error > EXACT
    aside = np.random.default_rng(4).normal(size=(MOVED, 3))
    aside *= BESIDE / np.linalg.norm(aside, axis=1, keepdims=True)
    for ray in np.flatnonzero(wrong):
        beside, _ = brute_force(mesh, origins[ray] + aside, np.broadcast_to(directions[ray], aside.shape))
        slack = EXACT / np.linalg.norm(directions[ray].astype(float)) + FLOAT32 * np.abs(hits.t[ray])
        with np.errstate(invalid="ignore"):
            is_tie = (np.isinf(beside) & np.isinf(hits.t[ray])) | (np.abs(beside - hits.t[ray]) < slack)
        outcome.defects += not is_tie.any()
    outcome.wrong_hits, outcome.wrong_misses = int((hit & ~true).sum()), int((true & ~hit).sum())
    outcome.disagree = int(wrong.sum())
    outcome.worst = float(error[error <= EXACT].max(initial=0.0)) * TEXELS / 2
    outcome.limit = f"as float64 says of a ray within {BESIDE:g} of the knot's size, to {EXACT:g} of it"
    outcome.passed = outcome.defects == 0 and int(true.sum()) > KNOT_HITS * len(true)
    return outcome


def city(count: int) -> tuple[ldtrefl.Mesh, np.ndarray, np.ndarray]:
    """Boxes of sizes over six decades, anywhere: the mesh, (n,) half sides and (n, 3) middles."""
    rng = np.random.default_rng(0)
    half, middle = 10.0 ** rng.uniform(-3, 3, count), rng.uniform(-2000, 2000, (count, 3))
    box = shapes.make("box")
    vertices = (box.vertices * half[:, None, None] + middle[:, None]).reshape(-1, 3)
    faces = (box.faces + len(box.vertices) * np.arange(count)[:, None, None]).reshape(-1, 3)
    return ldtrefl.Mesh(vertices, faces), half, middle


def rays_to_boxes(count: int, half: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a few sizes of a box to it, beside it and into it, boxes of all sizes alike."""
    rng = np.random.default_rng(3)
    picked = rng.integers(0, len(half), count)
    around = rng.normal(size=(count, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    reach = half[picked, None]
    origins = (middle[picked] + around * reach * 10.0 ** rng.uniform(0.5, 2, (count, 1))).astype(np.float32)
    return origins, (middle[picked] + rng.uniform(-1.2, 1.2, (count, 3)) * reach - origins).astype(np.float32)


def distance_to_boxes(half: np.ndarray, middle: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n,) first hits by slab tests in float64, in lengths of each direction."""
    first = []
    for o, d in zip(origins.astype(float), directions.astype(float), strict=True):
        a, b = (middle - half[:, None] - o) / d, (middle + half[:, None] - o) / d
        enter, leave = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
        t = np.where(enter >= 0, enter, leave)
        first.append(np.where((enter <= leave) & (leave >= 0), t, np.inf).min())
    return np.array(first)


def judge_city(
    outcome: Outcome,
    mesh: ldtrefl.Mesh,
    half: np.ndarray,
    middle: np.ndarray,
    hits: ldtrefl.Hits,
    origins: np.ndarray,
    directions: np.ndarray,
) -> Outcome:
    """Every answer is the true one of the ray, or of a ray within ``TIE`` of the city's size of it."""
    size = float((mesh.bounds[1] - mesh.bounds[0]).max())
    length = np.linalg.norm(directions.astype(float), axis=1)
    true_t, t = distance_to_boxes(half, middle, origins, directions) * length, hits.t * length
    finite = np.isfinite(t) & np.isfinite(true_t)
    wrong = np.isfinite(t) != np.isfinite(true_t)
    wrong[finite] = np.abs(t[finite] - true_t[finite]) > TIE * size + FLOAT32 * true_t[finite]
    aside = np.random.default_rng(4).normal(size=(MOVED, 3))
    aside *= TIE * size / np.linalg.norm(aside, axis=1, keepdims=True)
    for ray in np.flatnonzero(wrong):
        rays = origins[ray] + aside, np.broadcast_to(directions[ray], aside.shape)
        beside = distance_to_boxes(half, middle, *rays) * length[ray]
        with np.errstate(invalid="ignore"):
            is_tie = (np.isinf(beside) & np.isinf(t[ray])) | (np.abs(beside - t[ray]) < TIE_SLACK * TIE * size)
        outcome.defects += not is_tie.any()
    outcome.wrong_hits = int((np.isfinite(t) & ~np.isfinite(true_t)).sum())
    outcome.wrong_misses = int((np.isfinite(true_t) & ~np.isfinite(t)).sum())
    outcome.limit = f"another answer only within {TIE:g} of the city's size of an edge"
    outcome.passed = outcome.defects == 0 and int(finite.sum()) > CITY_HITS * len(t)
    return outcome
