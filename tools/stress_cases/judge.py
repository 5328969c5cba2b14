"""A tracer's hits against the truth, and the classification of disagreements.

A disagreement (a hit too many, a hit too few, a hit elsewhere) is *explained* when the truth itself gives the tracer's
answer for a ray moved aside by at most a *radius*: the ray passes within that radius of a silhouette or of a tie
between coincident surfaces. What no radius within the limit explains is a defect. Every disagreement is examined, and
percentiles of the distance are of *all* rays that hit and should, or of all but the explained: an error is never left
out for being large.
"""

from __future__ import annotations

import time

import numpy as np
import warp as wp

import ldtrefl

from .inputs import tracers
from .outcomes import TEXELS, Limit, Outcome, describe, limits
from .truth import Truth

wp.config.log_level = wp.LOG_ERROR

RADII = (1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0)
"""Texels by which a ray is moved aside, smallest first, to explain a disagreement."""

MOVED = 96
"""Rays about one for each radius."""

INWARDS = (1.0, 0.5, 0.1, 0.01)
"""Shares of a radius by which the first of them are moved towards the middle of the triangle that was found: at a sharp
corner chance does not find the way."""

JUMP = 16.0
"""Radii by which the truth must jump from one moved ray to the next for there to be a silhouette between them."""

ALONG_SLOPE = 4.0
"""Radii by which the distance of a hit may change when its ray is moved aside by one: surfaces at up to 75 degrees."""

FLOAT32 = 2.4e-7
"""Relative rounding of a float32, four times."""

OUTSIDE = 1e-3
"""By how much a barycentric may be below 0."""

FLAT = 1e-4
"""Sine of a triangle's angle at its first corner below which it is nearly a line, and has no normal in float32."""

LEAST_COSINE = 0.999
"""Between a hit's normal and its triangle's: 2.6 degrees."""

ENOUGH_DEFECTS = 100
"""Disagreements that nothing explains, or twice as many as the limit allows, after which a run is known to have failed:
the rest are not examined, and count as defects."""

LEAST_LENGTH = 1e-300
"""A least length to divide by."""


def judge_mesh(
    case: str,
    what: str,
    mesh: ldtrefl.Mesh,
    origins: np.ndarray,
    directions: np.ndarray,
    held_to: dict[str, Limit] | None = None,
    resolution: int = TEXELS,
    least: float = 0.02,
) -> list[Outcome]:
    """Every tracer against the truth on the same rays, of which a share ``least`` must truly hit; none if it is 0."""
    origins, directions = (np.ascontiguousarray(x, np.float32) for x in (origins, directions))
    truth = Truth(mesh)
    true_t = truth.hits(origins, directions)
    share = float(np.isfinite(true_t).mean())
    outcomes = []
    for by, trace in tracers(mesh, resolution):
        start = time.perf_counter()
        hits = trace(origins, directions)
        outcome = judge(truth, origins, directions, true_t, hits, (held_to or limits())[by])
        outcome.case, outcome.what, outcome.by = case, what, by
        outcome.passed &= share >= least if least > 0 else share == 0
        outcome.seconds = time.perf_counter() - start
        outcomes.append(outcome)
    return outcomes


def judge(
    truth: Truth, origins: np.ndarray, directions: np.ndarray, true_t: np.ndarray, hits: ldtrefl.Hits, limit: Limit
) -> Outcome:
    """One tracer's hits against the truth."""
    texel = 2.0 * truth.half / TEXELS
    t = np.asarray(hits.t, float)
    hit, true = hits.triangle >= 0, np.isfinite(true_t)
    broken = np.isnan(t) | (hit != np.isfinite(t)) | ~np.isfinite(hits.normal).all(axis=1)
    broken |= ~np.isfinite(hits.barycentrics).all(axis=1) | (hits.triangle >= len(truth.mesh.faces))
    both = hit & true
    length = np.linalg.norm(directions.astype(float), axis=1)
    error = np.zeros(len(t))
    # The distance is a float32, which far away is coarser than a texel: its own rounding is no error.
    off = np.abs(t[both] - true_t[both])
    error[both] = np.maximum(off - FLOAT32 * true_t[both], 0.0) * length[both] / texel
    error[np.isnan(error)] = np.inf
    disagree = np.flatnonzero((hit != true) | (error > limit.worst))
    is_explained = np.zeros(len(t), bool)
    radius, defects = 0.0, 0
    for number, i in enumerate(disagree if limit.defects < 100 else ()):
        found = np.inf  # nothing explains what is no answer
        if not broken[i]:
            found = explaining_radius(truth, origins[i], directions[i], t[i], int(hits.triangle[i]), texel, limit.slips)
        radius = max(radius, found)
        is_explained[i] = found <= limit.radius
        defects += not is_explained[i]
        if defects >= max(ENOUGH_DEFECTS, 0.02 * limit.defects * len(t)):
            defects += len(disagree) - number - 1
            break
    counted = error[both & ~is_explained]
    outcome = Outcome(
        tried=len(t),
        wrong_hits=int((hit & ~true).sum()),
        wrong_misses=int((true & ~hit).sum()),
        worst=float(counted.max(initial=0.0)),
        p999=float(np.percentile(counted, 99.9)) if len(counted) else 0.0,
        p99=float(np.percentile(error[both], 99)) if both.any() else 0.0,
        explained=int(is_explained.sum()),
        radius=radius,
        defects=defects,
        misnamed=int(misnamed(truth, origins, directions, hits, limit.place).sum()) if np.isfinite(limit.place) else 0,
        non_finite=int(broken.sum()),
        limit=describe(limit),
    )
    outcome.disagree = len(disagree)
    outcome.passed = (
        outcome.non_finite == 0
        and outcome.misnamed == 0
        and outcome.p99 <= limit.p99
        and outcome.p999 <= limit.p999
        and len(disagree) <= max(1.0, limit.wrong / 100.0 * len(t))
        and defects <= limit.defects / 100.0 * len(t)
    )
    return outcome


def misnamed(truth: Truth, origins: np.ndarray, directions: np.ndarray, hits: ldtrefl.Hits, place: float) -> np.ndarray:
    """(n,) bool: hits whose barycentrics lie outside their triangle or name a point more than ``place`` texels
    from the ray's end, or whose normal is not their triangle's by its winding."""
    found = np.zeros(len(hits.t), bool)
    at = np.flatnonzero((hits.triangle >= 0) & (hits.triangle < len(truth.mesh.faces)) & np.isfinite(hits.t))
    a, b, c = np.moveaxis(truth.mesh.vertices[truth.mesh.faces[hits.triangle[at]]], 1, 0)
    u, v = hits.barycentrics[at].astype(float).T[..., None]
    t, d = hits.t[at, None].astype(float), directions[at].astype(float)
    # Far from the origin float32 rays, and the ends they lead to, stand on a lattice.
    size = np.abs(origins[at]).max(axis=1) + np.abs(t[:, 0]) * np.linalg.norm(d, axis=1) + np.abs(a).max(axis=1)
    apart = np.linalg.norm((1 - u - v) * a + u * b + v * c - (origins[at] + t * d), axis=1)
    elsewhere = apart > place * 2.0 * truth.half / TEXELS + FLOAT32 * size
    outside = np.minimum(np.minimum(u, v), 1 - u - v)[:, 0] < -OUTSIDE
    edge, other = (b - a) / truth.half, (c - a) / truth.half
    facet = np.cross(edge, other)
    area = np.linalg.norm(facet, axis=1)
    # A triangle that is nearly a line has no normal in float32.
    sound = area > FLAT * np.linalg.norm(edge, axis=1) * np.linalg.norm(other, axis=1)
    cosine = (facet * hits.normal[at]).sum(axis=1) / np.where(sound, area, 1.0)
    found[at] = elsewhere | outside | (sound & (cosine < LEAST_COSINE))
    return found


def explaining_radius(
    truth: Truth, origin: np.ndarray, direction: np.ndarray, t: float, triangle: int, texel: float, slips: bool
) -> float:
    """The least of ``RADII`` by which the ray is moved aside for the truth to give ``t``; infinite if none is.

    With ``slips`` it is enough that the truth jumps there, from hit to miss or to another distance.
    """
    rng = np.random.default_rng(0)
    o, d = origin.astype(float), direction.astype(float)
    length, inner = np.linalg.norm(d), len(INWARDS)
    # Aside, and so that far rays are moved aside where they meet the object, not at their start.
    ways = rng.normal(size=(MOVED, 3))
    if triangle >= 0:
        corners = truth.mesh.vertices[truth.mesh.faces[triangle]]
        inwards = corners.mean(axis=0) - (o + t * d)
        ways[:inner] = np.array(INWARDS)[:, None] * inwards
    ways[inner:] /= np.linalg.norm(ways[inner:], axis=1, keepdims=True)
    ways[:inner] /= max(float(np.linalg.norm(ways[0])), LEAST_LENGTH)
    truth = truth.near(o, d, RADII[-1] * texel)
    for radius in RADII:
        moved = np.sort(truth.hits(o + radius * texel * ways, np.broadcast_to(d, (MOVED, 3))))
        with np.errstate(invalid="ignore"):
            if slips and np.nan_to_num(np.diff(moved), nan=0.0).max() > JUMP * radius * texel / length:
                return radius
        if not np.isfinite(t):
            if not np.isfinite(moved).all():
                return radius
        else:
            finite = moved[np.isfinite(moved)]
            if len(finite):
                # Half as far again as the moved rays' hits lie apart: at grazing angles they are few and far between.
                slack = ALONG_SLOPE * radius * texel / length + FLOAT32 * t + 0.5 * (finite.max() - finite.min())
                if finite.min() - slack <= t <= finite.max() + slack:
                    return radius
    return np.inf
