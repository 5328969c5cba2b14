"""Surfaces continued beyond their rims, against those that they are part of."""

import numpy as np
import pytest

from ldtrefl.methods.virtual.rim import RIM, Radii, continue_beyond_rim
from tests.methods.virtual.ellipsoids import directions

SHIFT = np.array([0.1, -0.2, 0.3])


def sphere(ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere about ``SHIFT``."""
    along = ways @ SHIFT
    root = np.sqrt(along**2 + 1.0 - SHIFT @ SHIFT)
    radii = along + root
    gradients = radii[:, None] * (SHIFT - along[:, None] * ways) / root[:, None]
    return radii, gradients


def plane(ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The plane x + 0.2 y = 1, of directions that meet it."""
    normal = np.array([1.0, 0.2, 0.0])
    along = np.maximum(ways @ normal, 0.1)
    return 1.0 / along, -(normal - along[:, None] * ways) / along[:, None] ** 2


@pytest.mark.parametrize("whole", [sphere, plane])
def test_the_part_is_continued_as_the_whole(whole: Radii) -> None:
    ways = directions(20_000)
    angles = np.arccos(ways[:, 0])

    def part(of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        radii, gradients = whole(of)
        is_there = of[:, 0] > np.cos(0.5)
        return np.where(is_there, radii, 0.0), np.where(is_there[:, None], gradients, 0.0)

    radii, gradients = part(ways)
    continue_beyond_rim(ways, radii, gradients, part)
    exact, exact_gradients = whole(ways)
    is_met, is_near, is_far = angles < 0.5, angles < 0.5 + 0.6 * RIM, angles > 0.5 + RIM
    assert np.array_equal(radii[is_met], exact[is_met]) and not radii[is_far].any()
    assert np.allclose(radii[is_near], exact[is_near], rtol=0.02)
    assert np.allclose(gradients[is_near], exact_gradients[is_near], atol=0.2)
    assert np.allclose(np.einsum("ij,ij->i", gradients, ways), 0.0, atol=1e-9)


def test_what_is_closed_or_empty_stays_as_it_is() -> None:
    ways = directions(100)
    for radii, gradients in (sphere(ways), (np.zeros(100), np.zeros((100, 3)))):
        before = radii.copy(), gradients.copy()
        continue_beyond_rim(ways, radii, gradients, sphere)
        assert np.array_equal(radii, before[0]) and np.array_equal(gradients, before[1])
