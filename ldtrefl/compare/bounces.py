"""How a method's hits differ from the true ones, bounce by bounce.

A ray of a later bounce is compared only where each hit before it is the true one. Elsewhere it is another ray, which
tells nothing of how this bounce was searched for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from ldtrefl.frame.bounce_hits import BounceHits, FirstHits

SAME_PLACE = 1.0
"""Texels between a hit and the true one, along the ray, up to which a ray counts as going on from the same place: what
the paper's search tells apart."""


@dataclass(frozen=True)
class BounceErrors:
    """Rays of one bounce that end where they should not."""

    bounce: int
    """1 is the first."""
    compared: int
    """Rays that both have followed this far, by the same places."""
    wrong_hits: int
    """Of these, rays that hit something where the truth hits nothing."""
    wrong_misses: int
    """Rays that hit nothing where the truth hits something."""
    wrong_objects: int
    """Rays that hit another object than the truth's."""


def errors_by_bounce(
    hits: FirstHits, truth: FirstHits, texel_sizes: np.ndarray, mask: np.ndarray
) -> tuple[BounceErrors, ...]:
    """The errors of every bounce that the truth has.

    Args:
        texel_sizes: (objects,) world units, the length of a texel of each object's maps.
        mask: (h, w) bool.
    """
    errors, same = [], mask
    for bounce, (found, true) in enumerate(zip((hits, *hits.later), (truth, *truth.later), strict=False), 1):
        compared = same & found.followed & true.followed
        errors.append(_errors_of(bounce, found, true, compared))
        same = compared & _is_same_place(found, true, texel_sizes)
    errors += [BounceErrors(bounce, 0, 0, 0, 0) for bounce in range(len(errors) + 1, len(truth.later) + 2)]
    return tuple(errors)


def bounce_table(errors: Mapping[str, tuple[BounceErrors, ...]], title: str) -> Table:
    """A line for each bounce of a method."""
    table = Table(title=title)
    for heading in ("method", "bounce", "rays compared", "wrong hits", "wrong misses", "wrong objects"):
        table.add_column(heading, justify="left" if heading == "method" else "right", overflow="fold")
    for name, bounces in errors.items():
        for row in bounces:
            counts = (row.bounce, row.compared, row.wrong_hits, row.wrong_misses, row.wrong_objects)
            table.add_row(name if row.bounce == 1 else "", *map(str, counts))
    return table


def _errors_of(bounce: int, hits: BounceHits, truth: BounceHits, compared: np.ndarray) -> BounceErrors:
    found, true = hits.object[compared], truth.object[compared]
    return BounceErrors(
        bounce,
        len(true),
        int(((found >= 0) & (true < 0)).sum()),
        int(((found < 0) & (true >= 0)).sum()),
        int(((found >= 0) & (true >= 0) & (found != true)).sum()),
    )


def _is_same_place(hits: BounceHits, truth: BounceHits, texel_sizes: np.ndarray) -> np.ndarray:
    """(h, w) bool: pixels whose rays hit the same object in the same place. A distance that is NaN is none."""
    is_same = (truth.object >= 0) & (hits.object == truth.object)
    off = np.abs(hits.distance[is_same].astype(float) - truth.distance[is_same])
    is_same[is_same] = off <= SAME_PLACE * texel_sizes[truth.object[is_same]]
    return is_same
