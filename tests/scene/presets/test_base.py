"""Directions of a picture of all that is around."""

import numpy as np
import pytest

from ldtrefl.scene.presets.base import direction, mean_radiance, picture_directions, solid_angles


def test_a_pictures_directions() -> None:
    """Up at the top, azimuth 0 in the middle column, columns clockwise seen from above: azimuth 90 a quarter left."""
    made = picture_directions(180)
    assert made.shape == (180, 360, 3)
    np.testing.assert_allclose(np.linalg.norm(made, axis=-1), 1.0, atol=1e-6)
    for row, column, azimuth, elevation in ((0, 180, -0.5, 89.5), (90, 180, -0.5, -0.5), (60, 90, 89.5, 29.5)):
        np.testing.assert_allclose(made[row, column], direction(azimuth, elevation), atol=1e-6)


def test_direction() -> None:
    np.testing.assert_allclose(direction(90.0, 0.0), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(direction(0.0, 30.0), [np.sqrt(0.75), 0, 0.5], atol=1e-12)


def test_means_over_the_sphere() -> None:
    """Of 1 it is 1, of the squared height a third, of what is above the horizon a half."""
    assert solid_angles(64).sum() * 128 == pytest.approx(4.0 * np.pi)
    height = picture_directions(64)[..., 2]
    picture = np.stack([np.ones_like(height), height**2, height > 0.0], axis=-1)
    np.testing.assert_allclose(mean_radiance(picture), [1.0, 1.0 / 3.0, 0.5], rtol=1e-3)
