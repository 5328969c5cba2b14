"""Case 11: meshes, places, options and rays drawn together at random; every disagreement is classified.

The examples are the same wherever the case runs: Hypothesis would draw others when other modules are imported.
"""

from __future__ import annotations

import dataclasses
import time

import numpy as np

import ldtrefl
from ldtrefl.ldt.exact.record_choice import FEW_TRIANGLES
from ldtrefl.ldt.options import Quality
from ldtrefl.scene import shapes

from .inputs import moved
from .judge import judge
from .outcomes import DENSE, TEXELS, Limit, Outcome, describe, linear_limit
from .truth import Truth

NAME = "11 fuzz"
SEED = 11
RAYS = (1000, 5000)
"""Rays of an example, at least and at most."""

DOUBTFUL = 1e-3
"""Texels between a tracer's hit and Embree's from which float64 is asked: Embree computes in float32."""

SHAPES = (
    "sphere",
    "box",
    "hollow_box",
    "torus",
    "torus_knot",
    "genus3",
    "gyroid",
    "bowl",
    "room",
    "wires",
    "plane",
    "teapot",
)
SMALL = {"sphere": [24, 12], "torus": [24, 12], "torus_knot": [64, 8]}
FUZZ = Limit(
    radius=0.3,
    worst=0.1,
    p999=0.1,
    p99=np.inf,
    wrong=60.0,
    place=3.0,
    why="any mesh, stretched up to 1:100, slim triangles met at grazing angles, from inside, outside and on it",
)
POOLED = {"exact": 2.0, "balanced": 2.0, "fast": 2.0, "linear": 50.0, "bvh": 1.0}
"""Percent of the rays of all examples together that may disagree, however well explained: a single example may consist
of ties alone."""
TRACERS = ("exact", "balanced", "fast", "linear", "bvh")


def drawn_mesh(generator: np.random.Generator) -> ldtrefl.Mesh:
    """A shape, or triangles at random; some of them dropped, doubled or turned over; stretched and moved."""
    kind = generator.choice((*SHAPES, "soup", "fan", "lattice", "dense"))
    if kind == "soup":
        corners = generator.uniform(-1, 1, (generator.integers(1, 401), 1, 3))
        vertices = corners + generator.normal(size=(len(corners), 3, 3)) * generator.choice((1e-4, 1e-2, 1.0))
        mesh = ldtrefl.Mesh(vertices.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    elif kind == "fan":
        around = np.linspace(0, 2 * np.pi, generator.integers(3, 201))
        rim = np.column_stack([np.cos(around), np.sin(around), 0.1 * np.cos(5 * around)])
        n = len(rim)
        mesh = ldtrefl.Mesh(np.vstack([rim, [[0, 0, 0.3]]]), np.array([[n, i, (i + 1) % n] for i in range(n)]))
    elif kind == "lattice":
        vertices = generator.integers(-3, 4, (60, 3)).astype(float)
        mesh = ldtrefl.Mesh(vertices, generator.integers(0, 60, (200, 3)))
    elif kind == "dense":
        mesh = shapes.make("torus_knot", {"segments": [int(generator.integers(1900, 2301)), 125]})
    else:
        mesh = shapes.make(kind, {"segments": SMALL[kind]} if kind in SMALL else None)
    faces = mesh.faces
    if kind != "dense":
        if generator.random() < 0.5:
            faces = faces[generator.random(len(faces)) < generator.uniform(0.3, 1.0)]
        if generator.random() < 0.5:
            faces = np.concatenate([faces, faces[: len(faces) // 3], faces[: len(faces) // 5, ::-1]])
    faces = faces if len(faces) else mesh.faces
    stretch = [10.0 ** generator.uniform(-2, 0) for _ in range(3)] if kind != "dense" else [1.0] * 3
    turn, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    vertices = (mesh.vertices * stretch) @ (turn if generator.random() < 0.5 else np.eye(3))
    return moved(ldtrefl.Mesh(vertices, faces), 10.0 ** generator.uniform(-6, 6), 0.0)


def rays_of_all_kinds(mesh: ldtrefl.Mesh, count: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Rays from outside and from within the box, to points of the box, of the surface, and anywhere."""
    centre, half = mesh.unit_frame
    low, high = mesh.bounds
    around = generator.normal(size=(count, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    corners = mesh.vertices[mesh.faces[generator.integers(0, len(mesh.faces), count)]]
    surface = (generator.dirichlet((1, 1, 1), count)[:, :, None] * corners).sum(axis=1)
    box = generator.uniform(low, high, (count, 3))
    kind = generator.integers(0, 8, count)[:, None]
    origins = np.where(kind < 6, centre + half * 10.0 ** generator.uniform(0.2, 3, (count, 1)) * around, box)
    targets = np.where(kind % 2 == 0, surface, generator.uniform(low, high, (count, 3)))
    directions = np.where(kind == 5, generator.normal(size=(count, 3)) * half, targets - origins)
    return origins.astype(np.float32), (directions / half).astype(np.float32)


def run(rays: int, pictures: int) -> list[Outcome]:
    """Examples until ``rays`` rays have been traced."""
    totals = {by: Outcome(NAME, "meshes, places, options and rays", by) for by in TRACERS}
    count = min(max(rays // 100, RAYS[0]), RAYS[1])
    examples = max(1, rays // (count * len(TRACERS)))

    for number in range(examples):
        generator = np.random.default_rng((SEED, number))
        mesh, resolution = drawn_mesh(generator), int(generator.choice((16, 64, 256, 700)))
        origins, directions = rays_of_all_kinds(mesh, count, generator)
        truth = Truth(mesh)
        # Embree first, brute force where it disagrees: a million rays against every triangle take minutes.
        quick = Truth(mesh, always_embree=True)
        true_t = quick.hits(origins, directions)
        for by in TRACERS:
            start = time.perf_counter()
            if by == "bvh":
                hits = ldtrefl.Raycaster(mesh.vertices, mesh.faces).trace(origins, directions)
            else:
                search = "linear" if by == "linear" else "exact"
                chosen: Quality = "exact" if by == "linear" else by  # type: ignore[assignment]
                maps = ldtrefl.peel(mesh.vertices, mesh.faces, resolution, quality=chosen, search=search)
                hits = maps.trace(origins, directions, search=search)
            if by != "linear":
                true_t = corrected(truth, origins, directions, true_t, hits)
            outcome = judge(truth, origins, directions, true_t, hits, limit_of(by, mesh, resolution))
            total = totals[by]
            for name in ("tried", "wrong_hits", "wrong_misses", "disagree", "explained", "defects", "misnamed"):
                setattr(total, name, getattr(total, name) + getattr(outcome, name))
            total.non_finite += outcome.non_finite
            # Of the worst example, not of the mean, in which a bad example would not show.
            for name in ("worst", "p99", "p999", "radius"):
                setattr(total, name, max(getattr(total, name), getattr(outcome, name)))
            total.seconds += time.perf_counter() - start
            total.passed &= outcome.passed

    for by, total in totals.items():
        total.limit = f"{describe(limit_of(by, None))}; of all rays <= {POOLED[by]:g}% disagree"
        total.passed &= 100.0 * total.disagree <= POOLED[by] * total.tried
    return list(totals.values())


def limit_of(by: str, mesh: ldtrefl.Mesh | None, resolution: int = TEXELS) -> Limit:
    """What a tracer is held to on a mesh."""
    if by == "linear":
        return linear_limit(100.0, "resolutions from 16, stretched and thin meshes")
    if mesh is not None and len(mesh.faces) > FEW_TRIANGLES and by in ("balanced", "fast"):
        if resolution >= TEXELS:
            # From inside and from close by, grazing rays are as many as others: twice as many disagree.
            held = dataclasses.replace(DENSE[by], p99=DENSE[by].worst, p999=DENSE[by].worst, wrong=2 * DENSE[by].wrong)
            if by == "balanced":
                return held
            why = f"{DENSE[by].why}; of 1000 grazing rays one passes between such patches, which no radius explains"
            return dataclasses.replace(held, p999=np.inf, defects=0.2, why=why)
        # Errors are counted in texels of a 256 map, of which a texel of this map may be 16.
        coarser = TEXELS / resolution
        return dataclasses.replace(
            DENSE[by],
            radius=np.inf,
            worst=DENSE[by].worst * coarser,
            p99=np.inf,
            p999=np.inf,
            wrong=60.0 if by == "fast" else 25.0,
            why="patches of maps from 16 texels",
        )
    return FUZZ


def corrected(
    truth: Truth, origins: np.ndarray, directions: np.ndarray, true_t: np.ndarray, hits: ldtrefl.Hits
) -> np.ndarray:
    """The truth again, in float64, for the rays where a tracer and Embree disagree."""
    texel = 2 * truth.half / TEXELS
    length = np.linalg.norm(directions.astype(float), axis=1)
    with np.errstate(invalid="ignore"):
        doubtful = np.isfinite(true_t) != (hits.triangle >= 0)
        doubtful |= np.abs(true_t - hits.t) * length > DOUBTFUL * texel
    rows = np.flatnonzero(doubtful)
    if len(rows) and truth.is_brute:
        true_t = true_t.copy()
        true_t[rows] = truth.hits(origins[rows], directions[rows])
    return true_t
