"""Soft studio light."""

import numpy as np
import pytest

from ldtrefl.scene.studio import backdrop, studio_lighting, studio_lights


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


@pytest.mark.parametrize("zenith", [0.25, 0.5, 1.0, 1.2])
def test_a_backdrop_has_the_color_of_its_horizon(zenith: float) -> None:
    made = backdrop(np.full(3, 0.5), np.full(3, zenith))
    assert made.sky == (zenith,) * 3
    assert made.ground == (max(1.0 - zenith, 0.0),) * 3
