"""What is right where tracers disagree, and how wrong each answer is.

Where all that claim to be exact agree, the truth is the triangle they name, its distance in float64. Elsewhere each
triangle that anybody names is tested in float64 (signed volumes), and the first that the ray meets is the truth. A ray
that passes within ``EDGE`` of the edges of that triangle is decided by rounding: it is counted, and judged by nobody.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .models import Model
from .rays import Rays

EDGE = 2e-7
"""1e-7 of the mesh's longest side, which is 2."""

AGREED = 1e-5
"""Distances that differ by less, for their length, are one hit of theirs, on one sheet of the surface."""

SAME = 1e-6
"""Hits of two triangles so close along the ray are one: the triangles share an edge, or lie in one another."""

TEXELS = 128
"""Along the mesh's longest side: distances are given in them, whatever a map's resolution."""

Answer = tuple[np.ndarray, np.ndarray]
"""(n,) distances, +inf on a miss, and (n,) triangles, -1 on a miss."""


@dataclass(frozen=True)
class Truth:
    """First hits."""

    t: np.ndarray
    """(n,) float64, +inf on a miss."""
    triangle: np.ndarray
    """(n,) int64, -1 on a miss."""
    sure: np.ndarray
    """(n,) bool: not within rounding of an edge."""
    disputed: int
    """Rays on which exact tracers disagreed."""


def truth(model: Model, rays: Rays, exact: Mapping[str, Answer], others: Mapping[str, Answer]) -> Truth:
    """The truth about these rays, from answers that claim to be exact, and from others that name triangles to test."""
    t = np.stack([answer[0] for answer in exact.values()]).astype(float)
    hit = np.stack([answer[1] >= 0 for answer in exact.values()])
    with np.errstate(invalid="ignore"):  # two misses are inf apart from one another
        apart = np.ptp(np.where(hit, t, 0.0), axis=0) > AGREED * (1.0 + np.where(hit, t, 0.0).max(axis=0))
    disputed = np.flatnonzero((hit.any(axis=0) != hit.all(axis=0)) | apart)
    triangle = next(iter(exact.values()))[1].astype(np.int64)
    distance = np.full(len(triangle), np.inf)
    named = np.flatnonzero(triangle >= 0)
    distance[named] = _meet(model, rays, named, triangle[named])[0]
    sure = np.ones(len(triangle), bool)
    if len(disputed):
        candidates = np.stack([answer[1][disputed] for answer in (*exact.values(), *others.values())]).astype(np.int64)
        there, margin = np.full(candidates.shape, np.inf), np.full(candidates.shape, -np.inf)
        for row, named_here in enumerate(candidates):
            known = named_here >= 0
            there[row, known], margin[row, known] = _meet(model, rays, disputed[known], named_here[known])
        there[(margin < -EDGE) | (there < 0.0)] = np.inf
        first = there.argmin(axis=0), np.arange(len(disputed))
        met = np.isfinite(there[first])
        distance[disputed] = there[first]
        triangle[disputed] = np.where(met, candidates[first], -1)
        # A miss is sure: whatever anybody named is not met.
        sure[disputed] = ~met | (margin[first] > EDGE)
    return Truth(distance, triangle, sure, len(disputed))


def _meet(model: Model, rays: Rays, which: np.ndarray, triangle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays meet triangles' planes, float64, and how far inside the edges: the least distance of the ray's line to
    an edge's line, negative outside."""
    o, d = rays.origins[which].astype(float), rays.directions[which].astype(float)
    a, b, c = (x - o for x in model.vertices[model.faces[triangle]].astype(float).transpose(1, 0, 2))
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (a * normal).sum(axis=1) / (d * normal).sum(axis=1)
        sides = []
        for start, end in ((a, b), (b, c), (c, a)):
            volume = (d * np.cross(start, end)).sum(axis=1)
            sides.append(volume / np.maximum(np.linalg.norm(np.cross(d, end - start), axis=1), 1e-300))
    inside = np.stack(sides)
    return np.where(np.isfinite(t), t, np.inf), np.maximum(inside.min(axis=0), (-inside).min(axis=0))


def errors_of(answer: Answer, right: Truth) -> dict[str, float]:
    """Wrong hits and misses in percent of true hits, distances in texels, same triangle in percent of common hits."""
    t, triangle = answer
    hit, true_hit = (triangle >= 0) & right.sure, (right.triangle >= 0) & right.sure
    both = hit & true_hit
    apart = np.abs(t[both].astype(float) - right.t[both])
    p50, p99, p999 = np.percentile(apart * TEXELS / 2, [50, 99, 99.9]) if both.any() else (0.0, 0.0, 0.0)
    same = (triangle[both] == right.triangle[both]) | (apart <= SAME)
    return wrong_answers(hit, true_hit) | {
        "median": float(p50),
        "p99": float(p99),
        "p999": float(p999),
        "same_triangle": 100.0 * float(same.mean()) if both.any() else 100.0,
    }


def wrong_answers(hit: np.ndarray, true_hit: np.ndarray) -> dict[str, float]:
    """Wrong hits and misses in percent of true hits."""
    hits = max(int(true_hit.sum()), 1)
    return {
        "wrong_hits": 100.0 * float((hit & ~true_hit).sum()) / hits,
        "wrong_misses": 100.0 * float((true_hit & ~hit).sum()) / hits,
    }
