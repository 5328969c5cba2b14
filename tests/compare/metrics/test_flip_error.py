"""FLIP: order and ends."""

import numpy as np

from ldtrefl.compare.metrics import flip
from ldtrefl.files.srgb import linear_from_srgb
from tests.compare.metrics.images import noise


def test_equal_images_and_a_difference() -> None:
    image, mask = noise(), np.zeros((20, 30), bool)
    mask[5:15, 5:20] = True
    assert flip(image, image, mask) == 0.0
    flat = [linear_from_srgb(np.full((20, 30, 3), value, np.float32)) for value in (0.5, 0.4, 0.1)]
    small, large = flip(flat[1], flat[0], mask), flip(flat[2], flat[0], mask)
    assert 0.0 < small < large < 1.0


def test_an_empty_mask_has_none() -> None:
    assert np.isnan(flip(noise(), noise(), np.zeros((20, 30), bool)))
