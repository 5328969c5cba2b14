"""relMSE, against known errors."""

import numpy as np
import pytest

from ldtrefl.compare.metrics import relmse
from tests.compare.metrics.images import noise


def test_a_known_error() -> None:
    """Radiance 3 where 2 is true: (3 - 2)^2 / (2^2 + 0.01); and where 0 is true, 0.1^2 / 0.01."""
    mask = np.ones((4, 5), bool)
    two, three = (np.full((4, 5, 3), value, np.float32) for value in (2.0, 3.0))
    assert relmse(three, two, mask) == pytest.approx(1.0 / 4.01)
    assert relmse(0.05 * two, 0.0 * two, mask) == pytest.approx(1.0)
    assert relmse(two, two, mask) == 0.0


def test_only_the_mask_counts() -> None:
    image, mask = noise(), np.zeros((20, 30), bool)
    mask[5:15, 5:20] = True
    assert relmse(np.where(mask[..., None], image, 0.0), image, mask) == 0.0


def test_an_empty_mask_has_none() -> None:
    assert np.isnan(relmse(noise(), noise(), np.zeros((20, 30), bool)))
