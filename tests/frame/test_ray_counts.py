"""Counts of rays, against numpy's."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.frame.ray_counts import IN_A_ROW, RayCounts, counts_of
from ldtrefl.tracing.ray_buffers import empty_hits, empty_rays


@pytest.mark.parametrize("count", [0, 1, IN_A_ROW, 5 * IN_A_ROW + 3])
def test_sums_are_numpy_s(count: int) -> None:
    rng, device = np.random.default_rng(count), launch.resolve_device(None)
    rays, hits = empty_rays(count, device), empty_hits(count, device)
    source, returns = rng.integers(-1, 3, count), rng.integers(0, 2, count)
    searches, steps = rng.integers(0, 9, count), rng.integers(0, 1 << 30, count)  # more in all than int32 holds
    rays.source, hits.searches, hits.steps = (
        wp.array(values, dtype=wp.int32, device=device) for values in (source, searches, steps)
    )
    rays.may_return = wp.array(returns, dtype=wp.uint8, device=device)
    expected = RayCounts(
        int((source >= 0).sum()), int(returns[source >= 0].sum()), int(searches.sum()), int(steps.sum(dtype=np.int64))
    )
    assert counts_of(rays, hits) == expected
