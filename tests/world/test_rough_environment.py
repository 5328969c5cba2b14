"""Environments as rough surfaces show them, against closed forms."""

import numpy as np
import pytest

from ldtrefl.files.srgb import linear_from_srgb
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.world.reflectance_table import mean_cosine
from ldtrefl.world.rough_environment import COLUMNS, LEVELS, ROWS, rough_environment, shrunk


def heights(rows: int) -> np.ndarray:
    return np.cos((np.arange(rows) + 0.5) / rows * np.pi)


@pytest.mark.parametrize("turned", [False, True], ids=["by height", "across"])
def test_what_is_linear_in_the_direction_is_blurred_by_the_mean_cosine(turned: bool) -> None:
    """The lobe is round about the mirrored direction: of a linear function its mean is a factor on the slope."""
    rows, columns = 180, 360

    def along(height: int, width: int) -> np.ndarray:
        z, turn = heights(height)[:, None], (np.arange(width) + 0.5) / width * 2.0 * np.pi
        return np.sqrt(1.0 - z**2) * np.cos(turn) if turned else z + 0.0 * turn

    pixels = np.repeat((1.0 + 0.8 * along(rows, columns))[..., None], 3, axis=2).astype(np.float32)
    made = rough_environment(StoredPicture(pixels))
    for level in range(LEVELS):
        expected = 1.0 + 0.8 * mean_cosine(((level + 1) / LEVELS) ** 2) * along(ROWS, COLUMNS)
        np.testing.assert_allclose(
            made[level, :, :, 1], expected, atol=4e-3
        )  # most at the poles, where pixels are narrow


@pytest.mark.parametrize("size", [(64, 128), (128, 512), (100, 37), (3, 2)])
def test_shrunk_pictures_are_means_of_their_pixels(size: tuple[int, int]) -> None:
    """Against each pixel repeated so often that all lie in one of those made."""
    pixels = np.random.default_rng(2).integers(0, 256, (*size, 3), dtype=np.uint8)
    rows, columns = ROWS // np.gcd(ROWS, size[0]), COLUMNS // np.gcd(COLUMNS, size[1])
    wide = np.repeat(linear_from_srgb(pixels / 255.0).astype(float), columns, axis=1)
    wide = wide.reshape(size[0], COLUMNS, -1, 3).mean(axis=2)
    expected = np.repeat(wide, rows, axis=0).reshape(ROWS, -1, COLUMNS, 3).mean(axis=1)
    np.testing.assert_allclose(shrunk(pixels), expected, atol=1e-6)
