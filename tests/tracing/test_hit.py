"""What stands for a miss."""

import numpy as np

from ldtrefl.tracing.hit import no_hit


def test_a_miss_is_infinitely_far_and_names_no_triangle() -> None:
    miss = no_hit()
    assert np.isposinf(miss.t) and miss.triangle == -1
