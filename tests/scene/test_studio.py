"""Soft studio light."""

import numpy as np
import pytest

import ldtrefl
from ldtrefl.scene.studio import albedo_seen_as, backdrop, floor_light, studio_lighting, studio_lights


def test_white_that_all_lights_reach_does_not_clip() -> None:
    """The brightest of many normals, all over the sphere."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(20_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    seen = np.tile(studio_lighting().ambient, (len(normals), 1))
    for light in studio_lights():
        towards = -np.array(light.direction) / np.linalg.norm(light.direction)
        seen += np.maximum(normals @ towards, 0.0)[:, None] * light.radiance
    assert 0.9 < seen.max() < 1.0


def test_a_floor_of_that_albedo_looks_like_the_color() -> None:
    """As rendered, where all lights reach it."""
    color = np.array([0.3, 0.2, 0.1])
    scene = ldtrefl.Scene(
        camera=ldtrefl.Camera(eye=(0.0, 0.0, 5.0), look_at=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), width=3, height=2),
        lighting=studio_lighting(),
        lights=studio_lights(),
        objects=(ldtrefl.Object(shape="plane", scale=9.0, material=ldtrefl.Material(albedo=albedo_seen_as(color))),),
    )
    np.testing.assert_allclose(ldtrefl.render(scene).image[1, 1], color, atol=1e-3)
    assert (floor_light() < 1.0).all()


@pytest.mark.parametrize("zenith", [0.25, 0.5, 1.0, 1.2])
def test_a_backdrop_has_the_color_of_its_horizon(zenith: float) -> None:
    made = backdrop(np.full(3, 0.5), np.full(3, zenith))
    assert made.sky == (zenith,) * 3
    assert made.ground == (max(1.0 - zenith, 0.0),) * 3
