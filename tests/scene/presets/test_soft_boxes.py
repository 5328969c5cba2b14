"""The studio: what mirrors see of it, and what lights matt things, are the same light."""

import numpy as np
import pytest

from ldtrefl.scene.presets.base import direction, mean_radiance, picture_directions
from ldtrefl.scene.presets.soft_boxes import BOXES, EDGE, ROWS, studio

LIT_BY = [box for box in BOXES if box.casts_shadows]


def test_boxes_are_where_they_should_be() -> None:
    pixels, directions = studio().picture.pixels, picture_directions(ROWS)
    for box in BOXES:
        middle = np.unravel_index((directions @ direction(box.azimuth, box.elevation)).argmax(), directions.shape[:2])
        # Its own radiance, and that of the wall behind it.
        assert (pixels[middle] > 0.99 * np.array(box.radiance)).all()
        assert (pixels[middle] < np.array(box.radiance) + 0.6).all()


def test_no_light_is_lost_or_counted_twice() -> None:
    """Ambient light and a share of each rectangle's radiance, as large as that of the sphere which it fills, is the
    mean over the sphere."""
    made = studio()
    total = np.array(made.ambient)
    for light in made.rectangles:
        a, b = np.linalg.norm(light.right), np.linalg.norm(light.up)
        angle = 4.0 * np.arctan(a * b / np.sqrt(1.0 + a**2 + b**2))
        total += np.array(light.radiance) * angle / (4.0 * np.pi)
    np.testing.assert_allclose(total, mean_radiance(made.picture.pixels), rtol=1e-3)


def test_rectangles_are_where_mirrors_show_boxes() -> None:
    """All points within a rectangle are brighter than half its own box, and those just outside are darker."""
    made, directions = studio(), picture_directions(ROWS).reshape(-1, 3)
    pixels = made.picture.pixels.reshape(-1, 3)
    for light, box in zip(made.rectangles, LIT_BY, strict=True):
        ahead = directions @ light.middle
        x, y = (directions @ side / ahead / np.dot(side, side) for side in map(np.array, (light.right, light.up)))
        aside, margin = np.maximum(np.abs(x), np.abs(y)), EDGE / min(box.width, box.height)
        glow = pixels[:, 0] / box.radiance[0]
        assert glow[(ahead > 0.0) & (aside < 1.0 - margin)].min() > 0.6
        near = (ahead > 0.0) & (aside > 1.0 + margin) & (aside < 1.0 + 2.0 * margin)
        assert near.sum() > 100 and np.quantile(glow[near], 0.9) < 0.4  # a narrow box is beside the overhead one
        # A box is darker in its corners: its rectangle has the mean.
        assert 0.8 < light.radiance[0] / box.radiance[0] < 1.0


def test_white_that_all_lights_reach_does_not_clip() -> None:
    """The brightest of many normals, all over the sphere."""
    made = studio()
    normals = np.random.default_rng(0).normal(size=(2_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lit = np.array(made.ambient) + sum(light.scattered_by(normals) for light in made.rectangles)
    assert 0.85 < lit.max() < 1.0


def test_what_a_rectangle_makes_white_surfaces_scatter() -> None:
    """Straight above: Siegel and Howell, configuration factor of a differential element to a parallel rectangle."""
    light = studio().rectangles[0]
    a, b = np.linalg.norm(light.right), np.linalg.norm(light.up)
    quarter = a / np.hypot(1, a) * np.arctan(b / np.hypot(1, a)) + b / np.hypot(1, b) * np.arctan(a / np.hypot(1, b))
    scattered = light.scattered_by(np.array([light.middle, np.negative(light.middle)]))
    np.testing.assert_allclose(scattered[0], 4.0 * quarter / (2.0 * np.pi) * np.array(light.radiance), rtol=1e-3)
    assert scattered[1] == pytest.approx(0.0)
