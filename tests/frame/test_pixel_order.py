"""The order of pixels: every pixel of the mask once, block by block."""

import numpy as np
import pytest

from ldtrefl.frame.pixel_order import BLOCK, pixels_in_blocks


@pytest.mark.parametrize("shape", [(1, 1), (8, 8), (9, 7), (64, 48), (17, 100)])
def test_every_pixel_comes_once_in_the_order_of_blocks(shape: tuple[int, int]) -> None:
    mask = np.random.default_rng(0).random(shape) < 0.6
    pixels = pixels_in_blocks(mask)
    assert sorted(pixels.tolist()) == np.flatnonzero(mask).tolist()
    y, x = np.divmod(pixels.astype(np.int64), shape[1])
    place = np.stack([y // BLOCK, x // BLOCK, y % BLOCK, x % BLOCK])
    assert (np.lexsort(place[::-1]) == np.arange(len(pixels))).all()


def test_an_empty_mask_has_no_pixels() -> None:
    assert pixels_in_blocks(np.zeros((20, 30), bool)).shape == (0,)
