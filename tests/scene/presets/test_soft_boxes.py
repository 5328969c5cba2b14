"""The studio: what mirrors see of it, and what lights matt things, are the same light."""

import numpy as np
import pytest

from ldtrefl.scene.presets.base import direction, mean_radiance, picture_directions
from ldtrefl.scene.presets.soft_boxes import BOXES, ROWS, studio


def test_boxes_are_where_they_should_be() -> None:
    pixels, directions = studio().picture.pixels, picture_directions(ROWS)
    for box in BOXES:
        middle = np.unravel_index((directions @ direction(box.azimuth, box.elevation)).argmax(), directions.shape[:2])
        # Its own radiance, and that of the wall behind it.
        assert (pixels[middle] > 0.99 * np.array(box.radiance)).all()
        assert (pixels[middle] < np.array(box.radiance) + 0.6).all()


def test_no_light_is_lost_or_counted_twice() -> None:
    """Ambient light and a quarter of all lights is the mean over the sphere: a light from one direction of radiance r
    lights a surface by r, and by r / 4 in the mean over all ways to face."""
    made = studio()
    total = np.array(made.ambient) + 0.25 * np.sum([light.radiance for light in made.lights], axis=0)
    np.testing.assert_allclose(total, mean_radiance(made.picture.pixels), rtol=1e-3)


def test_a_box_gives_as_much_light_as_it_is_seen_to() -> None:
    """The key's lights together: a square of half-width w at distance 1 fills ``4 asin(w^2 / (1 + w^2))`` steradians;
    its rim and its corners are darker."""
    key = BOXES[0]
    angle = 4.0 * np.arcsin(key.width**2 / (1.0 + key.width**2))
    received = np.sum([light.radiance for light in studio().lights[:4]], axis=0)
    share = received / (np.array(key.radiance) * angle / np.pi)
    np.testing.assert_allclose(share, share[0], rtol=1e-3)
    assert 0.75 < share[0] < 0.95


def test_lights_are_seen_in_mirrors_already() -> None:
    assert all(light.is_in_picture for light in studio().lights)
    for light in studio().lights:
        assert np.linalg.norm(light.towards) == pytest.approx(1.0)


def test_white_that_all_lights_reach_does_not_clip() -> None:
    """The brightest of many normals, all over the sphere."""
    made = studio()
    normals = np.random.default_rng(0).normal(size=(20_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lit = np.tile(made.ambient, (len(normals), 1))
    for light in made.lights:
        lit += np.maximum(normals @ np.array(light.towards), 0.0)[:, None] * light.radiance
    assert 0.9 < lit.max() < 1.0
