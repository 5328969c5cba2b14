"""All methods over all scenes: medians and worst cases, and which method is exact and which is fastest."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .entries import TRUTH, Entry
from .measuring import Figures, SceneOutcome

EXACT = 0.9995
"""The SSIM from which on a picture passes for the truth: it is written 1.000."""
GOOD = 0.99
"""The SSIM at which methods are compared by time."""


@dataclass(frozen=True)
class Overall:
    """A method over all scenes that it is made for."""

    label: str
    scenes: int
    median: float
    """SSIM, and so are all but the last three."""
    worst: float
    worst_in: str
    """The scene."""
    median_of_one: float | None
    """Against the truth with one reflection, as the next."""
    worst_of_one: float | None
    first: float
    """Median of the time of a first frame in those of the truth, as the next."""
    later: float
    peak: float
    """Median of bytes at most."""


def overall(outcomes: Sequence[SceneOutcome], entry: Entry) -> Overall | None:
    """A method over all scenes; None if it takes none of them."""
    pairs = []
    for outcome in outcomes:
        own, true = outcome.by_label[entry.label].figures, outcome.by_label[TRUTH].figures
        assert true is not None
        if own is not None:
            pairs.append((outcome.name, own, true))
    if not pairs:
        return None
    worst_in, worst, _ = min(pairs, key=lambda pair: pair[1].ssim)
    of_one = [own.ssim_of_one for _, own, _ in pairs if own.ssim_of_one is not None]
    return Overall(
        label=entry.label,
        scenes=len(pairs),
        median=statistics.median(own.ssim for _, own, _ in pairs),
        worst=worst.ssim,
        worst_in=worst_in,
        median_of_one=statistics.median(of_one) if of_one else None,
        worst_of_one=min(of_one) if of_one else None,
        first=statistics.median(own.first / true.first for _, own, true in pairs),
        later=statistics.median(own.later / true.later for _, own, true in pairs),
        peak=statistics.median(own.peak for _, own, _ in pairs),
    )


def fastest(outcome: SceneOutcome, seconds: Callable[[Figures], float]) -> str | None:
    """The method that takes least time in a scene, of those whose SSIM is ``GOOD`` or more."""
    good = {
        label: seconds(found.figures)
        for label, found in outcome.by_label.items()
        if found.figures is not None and found.figures.ssim >= GOOD
    }
    return min(good, key=lambda label: good[label]) if good else None


def wins(outcomes: Sequence[SceneOutcome], seconds: Callable[[Figures], float]) -> list[tuple[str, int]]:
    """How often each method is the fastest, most often first."""
    found = (fastest(outcome, seconds) for outcome in outcomes)
    return Counter(label for label in found if label is not None).most_common()
