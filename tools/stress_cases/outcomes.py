"""What a case measures for a tracer (``Outcome``), and what it holds the tracer to (``Limit``).

Distances and radii are in texels of a map of ``TEXELS`` of the object, whatever the map's resolution.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

TEXELS = 256
"""Texels along an object's longest side that distances are given in."""


@dataclass(frozen=True)
class Limit:
    """What a tracer is held to in a case."""

    radius: float = 0.01
    """Texels from a silhouette or a tie within which disagreements may lie."""
    worst: float = 0.05
    """Texels between the hit and the true one beyond which it is a disagreement."""
    p999: float = 0.01
    """Texels between the hit and the true one, 99.9th percentile of all that are not explained."""
    p99: float = 0.01
    """The same, 99th percentile, of *all* rays that hit and should, the explained ones too."""
    wrong: float = 0.1
    """Percent of rays that may disagree at all, however well explained; one ray may in any case."""
    defects: float = 0.0
    """Percent of rays whose disagreement nothing within ``radius`` may explain; 100 if they are not examined at all."""
    slips: bool = False
    """Whether any answer counts as explained within ``radius`` of a silhouette, as between patches there may be a slit.
    Then ``wrong`` alone says how many may."""
    place: float = 0.1
    """Texels between the ray's end and the point that the triangle and the barycentrics name, the float32 rounding of
    the distance not counted; infinite where triangle, barycentrics and normal may be a neighbour's."""
    why: str = ""


LINEAR_WORST = 2.0
"""Texels beyond which a hit of the paper's search counts as wrong: its blocks are one wide and one deep."""

EXACT = Limit(why="float32: a thousandth of a texel, and ten times that at grazing angles")
LINEAR = Limit(
    worst=LINEAR_WORST,
    p99=np.inf,
    p999=np.inf,
    wrong=10.0,
    defects=100.0,
    place=np.inf,
    why="the paper's search steps over what is thin and sees texels as blocks: percent alone",
)


def linear_limit(percent: float, why: str) -> Limit:
    """The paper's search held to a share of wrong rays."""
    return dataclasses.replace(LINEAR, wrong=percent, why=why)


def limits(
    exact: Limit = EXACT, balanced: Limit | None = None, fast: Limit | None = None, linear: Limit = LINEAR
) -> dict[str, Limit]:
    """Limits by tracer: where triangles are larger than texels all qualities are held to the exact one's."""
    return {
        "exact": exact,
        "balanced": balanced or exact,
        "fast": fast or balanced or exact,
        "linear": linear,
        "bvh": exact,
    }


DENSE = limits(
    balanced=Limit(
        radius=1.0,
        worst=1.0,
        p999=0.9,
        p99=0.4,
        wrong=0.2,
        slips=True,
        place=np.inf,
        why="a patch is a plane of at most 1.4 texels: silhouettes move by up to half of one",
    ),
    fast=Limit(
        radius=3.0,
        worst=3.0,
        p999=3.0,
        p99=2.0,
        wrong=1.2,
        slips=True,
        place=np.inf,
        why="a patch is a plane of at most 3.2 texels: at silhouettes one ray in 300 ends on another surface, so that "
        "of all hits the 99.9th percentile is 60 texels",
    ),
)
"""Limits where triangles are smaller than texels and patches stand for them."""


@dataclass
class Outcome:
    """What a case measured for one tracer."""

    case: str = ""
    what: str = ""
    by: str = ""
    tried: int = 0
    wrong_hits: int = 0
    wrong_misses: int = 0
    worst: float = 0.0
    """Texels."""
    p999: float = 0.0
    """Texels; of all hits but the explained."""
    p99: float = 0.0
    """Texels; of all hits."""
    disagree: int = 0
    """Hits too many, too few, and farther off than the limit's ``worst``."""
    explained: int = 0
    """Disagreements that a silhouette or a tie within the limit's radius explains."""
    radius: float = 0.0
    """Texels within which every disagreement is explained; infinite where one is not."""
    defects: int = 0
    misnamed: int = 0
    """Hits whose triangle, barycentrics or normal are not those of the place where the ray ends."""
    non_finite: int = 0
    ssim: float = float("nan")
    """Over the reflectors' pixels; NaN where pictures are not compared so."""
    seconds: float = 0.0
    limit: str = ""
    passed: bool = True


def describe(limit: Limit) -> str:
    """A limit in a few words."""
    parts = [f"explained within {limit.radius:g} texels"] if limit.defects < 100 else []
    parts += [f"but for {limit.defects:g}%"] if 0 < limit.defects < 100 else []
    parts += [f"p99 <= {limit.p99:g}"] if np.isfinite(limit.p99) else []
    parts += [f"p99.9 <= {limit.p999:g}"] if np.isfinite(limit.p999) else []
    parts += [f"wrong <= {limit.wrong:g}%"] if limit.wrong < 100 else []
    parts += [f"a hit is wrong beyond {limit.worst:g} texels"] if np.isfinite(limit.worst) else []
    return ", ".join(parts) + (f" ({limit.why})" if limit.why else "")


def as_dict(outcome: Outcome) -> dict[str, object]:
    """For JSON: plain numbers, infinite ones become null."""
    values = {name: getattr(value, "item", lambda value=value: value)() for name, value in vars(outcome).items()}
    return {name: None if isinstance(v, float) and not np.isfinite(v) else v for name, v in values.items()}
