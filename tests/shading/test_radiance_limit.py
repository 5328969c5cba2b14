"""The brightest radiance that there is."""

import numpy as np
import warp as wp

from ldtrefl.shading.radiance_limit import LARGEST_RADIANCE, at_most_largest


def test_what_is_brighter_is_cut() -> None:
    largest = np.float32(LARGEST_RADIANCE)
    np.testing.assert_array_equal(at_most_largest(wp.vec3(1.0, np.inf, 1e35)), [1.0, largest, largest])
