"""A ray against a sphere, by closed form and by the quadratic in float64."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.sphere import enters_sphere, sphere_entry

CENTRE, RADIUS = np.array([1.0, -2.0, 0.5]), 1.5


@launch.kernel
def meet(
    first: int,
    # In:
    origins: wp.array(dtype=wp.vec3d),
    directions: wp.array(dtype=wp.vec3),
    centre: wp.vec3d,
    radius: float,
    t_max: float,
    # Out:
    t_out: wp.array(dtype=float),
    meets_out: wp.array(dtype=bool),
):
    """Each thread tests one ray."""
    i = first + wp.tid()
    t_out[i] = sphere_entry(origins[i], directions[i], centre, radius)
    meets_out[i] = enters_sphere(origins[i], directions[i], centre, radius, t_max)


def met(origins: np.ndarray, directions: np.ndarray, t_max: float = np.inf) -> tuple[np.ndarray, np.ndarray]:
    """(t of entry, whether the sphere is entered before ``t_max``) of rays."""
    device = launch.resolve_device(None)
    given = [wp.array(origins, dtype=wp.vec3d, device=device), wp.array(directions, dtype=wp.vec3, device=device)]
    t, meets = wp.zeros(len(origins), dtype=float, device=device), wp.zeros(len(origins), dtype=bool, device=device)
    launch.launch(meet, len(origins), [*given, wp.vec3d(*CENTRE), RADIUS, t_max, t, meets], device)
    return t.numpy(), meets.numpy()


@pytest.mark.parametrize(
    ("offset", "expected"),
    [
        ((0.0, 0.0, 5.0), 3.5),
        ((0.9, 0.0, 5.0), 5.0 - 1.2),
        ((0.0, 0.0, 1.0), 0.0),
        ((0.0, 0.0, -1.0), 0.0),
        ((0.0, 0.0, -1.6), -1.0),
        ((1.6, 0.0, 5.0), -1.0),
        ((0.0, 1.6, -5.0), -1.0),
    ],
)
def test_rays_down_the_axis(offset: tuple[float, ...], expected: float) -> None:
    t, meets = met(np.array([CENTRE + offset]), np.array([[0.0, 0.0, -1.0]]))
    assert t[0] == pytest.approx(expected, abs=1e-6) and meets[0] == (expected >= 0)


def test_random_rays_against_the_quadratic() -> None:
    rng = np.random.default_rng(0)
    origins = (CENTRE + rng.normal(0, 2, (5000, 3))).astype(np.float32)
    directions = rng.normal(size=(5000, 3))
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    t, meets = met(origins, directions)
    offset = origins.astype(float) - CENTRE
    b, c = (offset * directions).sum(axis=1), (offset**2).sum(axis=1) - RADIUS**2
    discriminant = b * b - c
    root = np.sqrt(np.maximum(discriminant, 0))
    is_met = (discriminant >= 0) & (root - b >= 0)
    sure = np.abs(discriminant) > 1e-4
    assert 0.1 < is_met.mean() < 0.9
    np.testing.assert_array_equal(meets[sure], is_met[sure])
    np.testing.assert_array_equal(t[sure] >= 0, is_met[sure])
    np.testing.assert_allclose(t[sure & is_met], np.maximum(-b - root, 0)[sure & is_met], atol=1e-4)
    for t_max in (0.0, 0.5, 2.0, 4.0):
        _, before = met(origins, directions, t_max)
        certain = sure & (np.abs(np.maximum(-b - root, 0) - t_max) > 1e-5)
        np.testing.assert_array_equal(before[certain], (is_met & (np.maximum(-b - root, 0) < t_max))[certain])
        assert 0.0 < before.mean() < is_met.mean()
