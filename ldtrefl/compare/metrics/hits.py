"""How a method's first hits differ from the true ones: rays that end where they should not, and how far off the others
are along the ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ldtrefl.compare.metrics.base import metric
from ldtrefl.frame.bounce_hits import FirstHits


@metric("wrong_hits", heading="wrong hit %", format=".3f", place=50)
def wrong_hits(hits: FirstHits, truth: FirstHits, mask: np.ndarray) -> float:
    """Rays that hit something where the truth hits nothing, in percent of true hits. If there are no true hits, any
    such ray makes it infinite."""
    return _percent_of_true_hits((hits.object >= 0) & (truth.object < 0), truth, mask)


@metric("wrong_misses", heading="wrong miss %", format=".3f", place=51)
def wrong_misses(hits: FirstHits, truth: FirstHits, mask: np.ndarray) -> float:
    """Rays that hit nothing where the truth hits something, in percent of true hits."""
    return _percent_of_true_hits((hits.object < 0) & (truth.object >= 0), truth, mask)


@metric("wrong_objects", heading="wrong object %", format=".3f", place=52)
def wrong_objects(hits: FirstHits, truth: FirstHits, mask: np.ndarray) -> float:
    """Rays that hit another object than the truth's, in percent of true hits."""
    return _percent_of_true_hits(_both_hit(hits, truth) & (hits.object != truth.object), truth, mask)


@metric("median", heading="texels p50", format=".3f", place=60)
def median_distance_error(hits: FirstHits, truth: FirstHits, texel_sizes: np.ndarray, mask: np.ndarray) -> float:
    """Median of :func:`distance_errors`; NaN if there are none."""
    return _percentile(distance_errors(hits, truth, texel_sizes, mask), 50)


@metric("p99", heading="p99", format=".2f", place=61)
def largest_distance_error(hits: FirstHits, truth: FirstHits, texel_sizes: np.ndarray, mask: np.ndarray) -> float:
    """99th percentile of :func:`distance_errors`; NaN if there are none."""
    return _percentile(distance_errors(hits, truth, texel_sizes, mask), 99)


def distance_errors(hits: FirstHits, truth: FirstHits, texel_sizes: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """(n,) distance along the ray from each hit to the true one, in texels of the object that is truly hit.

    Of rays inside the mask that hit something and should, be it another object. A distance that is NaN counts as an
    infinite error.

    Args:
        texel_sizes: (objects,) world units, the length of a texel of each object's maps.
        mask: (h, w) bool.
    """
    both = _both_hit(hits, truth) & mask
    errors = np.abs(hits.distance[both].astype(float) - truth.distance[both]) / texel_sizes[truth.object[both]]
    errors[np.isnan(errors)] = np.inf
    return errors


@dataclass(frozen=True)
class HitErrors:
    """The five metrics of this file."""

    wrong_hits: float
    wrong_misses: float
    wrong_objects: float
    median: float
    p99: float


def hit_errors(hits: FirstHits, truth: FirstHits, texel_sizes: np.ndarray, mask: np.ndarray) -> HitErrors:
    """All metrics of this file at once.

    Args:
        texel_sizes: (objects,) world units, the length of a texel of each object's maps.
        mask: (h, w) bool.
    """
    return HitErrors(
        wrong_hits(hits, truth, mask),
        wrong_misses(hits, truth, mask),
        wrong_objects(hits, truth, mask),
        median_distance_error(hits, truth, texel_sizes, mask),
        largest_distance_error(hits, truth, texel_sizes, mask),
    )


def _both_hit(hits: FirstHits, truth: FirstHits) -> np.ndarray:
    return (hits.object >= 0) & (truth.object >= 0)


def _percent_of_true_hits(wrong: np.ndarray, truth: FirstHits, mask: np.ndarray) -> float:
    count, true_hits = int((wrong & mask).sum()), int(((truth.object >= 0) & mask).sum())
    if true_hits == 0:
        return 0.0 if count == 0 else float("inf")
    return 100.0 * float(count) / true_hits


def _percentile(errors: np.ndarray, percent: float) -> float:
    # By nearest rank: between a number and infinity there is nothing to interpolate.
    return float(np.percentile(errors, percent, method="inverted_cdf")) if errors.size else float("nan")
