"""The picture of a difference: its colours say which image is brighter."""

import numpy as np

from ldtrefl.compare.difference import difference_image
from ldtrefl.files.srgb import srgb_from_linear


def test_difference_is_grey_where_equal_red_where_brighter_blue_where_darker() -> None:
    half = np.full((1, 1, 3), 0.5, np.float32)
    grey, red, blue = (srgb_from_linear(difference_image(x, half))[0, 0] for x in (half, 1.2 * half, 0.8 * half))
    np.testing.assert_allclose(grey, 0.5, atol=1e-5)
    assert red[0] > 0.5 > red[2] and blue[2] > 0.5 > blue[0]
