"""What is right where ray tracers disagree, and how wrong each answer is.

Every triangle that anybody names for a ray is tested in float64 (signed volumes), and the first that the ray meets is
the truth; a ray for which nobody names one that it meets is a miss. A ray that passes within ``EDGE`` of the edges of
that triangle is decided by rounding: it is counted, and judged by nobody.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .models import Model
from .rays import Rays
from .result import Errors

EDGE = 2e-7
"""1e-7 of the mesh's longest side, which is 2."""

SAME = 1e-6
"""Hits of two triangles so close along the ray are one: the triangles share an edge, or lie in one another."""

FLOAT32 = 2.4e-7
"""Relative rounding of a float32 distance, four times: no error, and long where an outlier is met."""

LEAST_LENGTH = 1e-300
"""To divide by."""

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


def truth(model: Model, rays: Rays, answers: Sequence[Answer]) -> Truth:
    """The truth about these rays, from everybody's answers."""
    named = np.stack([triangle for _, triangle in answers]).astype(np.int64)
    triangle, distance = named[0], np.full(named.shape[1], np.inf)
    sure = np.ones(named.shape[1], bool)
    agreed = (named == triangle).all(axis=0)
    known = np.flatnonzero(agreed & (triangle >= 0))
    distance[known] = _meet(model, rays, known, triangle[known])[0]
    disputed = np.flatnonzero(~agreed)
    if len(disputed):
        candidates = named[:, disputed]
        there, margin = np.full(candidates.shape, np.inf), np.full(candidates.shape, -np.inf)
        for row, candidate in enumerate(candidates):
            some = candidate >= 0
            there[row, some], margin[row, some] = _meet(model, rays, disputed[some], candidate[some])
        there[(margin < -EDGE) | (there < 0.0)] = np.inf
        first = there.argmin(axis=0), np.arange(len(disputed))
        met = np.isfinite(there[first])
        distance[disputed] = there[first]
        triangle[disputed] = np.where(met, candidates[first], -1)
        # A miss is sure: whatever anybody named is not met.
        sure[disputed] = ~met | (margin[first] > EDGE)
    return Truth(distance, triangle, sure)


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
            sides.append(volume / np.maximum(np.linalg.norm(np.cross(d, end - start), axis=1), LEAST_LENGTH))
    inside = np.stack(sides)
    return np.where(np.isfinite(t), t, np.inf), np.maximum(inside.min(axis=0), (-inside).min(axis=0))


def errors_of(answer: Answer, right: Truth) -> Errors:
    """Wrong hits and misses in percent of true hits, distances in texels, same triangle in percent of common hits."""
    t, triangle = answer
    hit, true_hit = (triangle >= 0) & right.sure, (right.triangle >= 0) & right.sure
    both = hit & true_hit
    apart = np.maximum(np.abs(t[both].astype(float) - right.t[both]) - FLOAT32 * right.t[both], 0.0)
    p50, p99, p999 = np.percentile(apart * TEXELS / 2, [50, 99, 99.9]) if both.any() else (0.0, 0.0, 0.0)
    same = (triangle[both] == right.triangle[both]) | (apart <= SAME)
    of_hits: Errors = {
        "median": float(p50),
        "p99": float(p99),
        "p999": float(p999),
        "same_triangle": 100.0 * float(same.mean()) if both.any() else 100.0,
    }
    return wrong_answers(hit, true_hit) | of_hits


def wrong_answers(hit: np.ndarray, true_hit: np.ndarray) -> Errors:
    """Wrong hits and misses in percent of true hits."""
    hits = max(int(true_hit.sum()), 1)
    return {
        "wrong_hits": 100.0 * float((hit & ~true_hit).sum()) / hits,
        "wrong_misses": 100.0 * float((true_hit & ~hit).sum()) / hits,
    }
