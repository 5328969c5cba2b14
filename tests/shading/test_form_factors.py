"""Form factors of spheres and rectangles against integrals over their surface, in float64."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.shading.form_factors import rectangle_form_factor, sphere_form_factor

SIDE = 1500
"""Points along a side of the grid that is summed over."""


@launch.kernel
def find_sphere(
    first: int,
    # In:
    cosines: wp.array(dtype=float),
    sines_squared: wp.array(dtype=float),
    # Out:
    factor_out: wp.array(dtype=float),
):
    """Each thread finds one form factor."""
    i = first + wp.tid()
    factor_out[i] = sphere_form_factor(cosines[i], sines_squared[i])


@launch.kernel
def find_rectangle(
    first: int,
    # In:
    offsets: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    right: wp.vec3,
    up: wp.vec3,
    # Out:
    factor_out: wp.array(dtype=float),
):
    """Each thread finds one form factor."""
    i = first + wp.tid()
    factor_out[i] = rectangle_form_factor(offsets[i], right, up, normals[i])


def of_rectangles(offsets: np.ndarray, normals: np.ndarray, right: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(n,) form factors."""
    cpu = launch.resolve_device(None)
    found = wp.zeros(len(offsets), dtype=float, device=cpu)
    arrays = [wp.array(values, dtype=wp.vec3, device=cpu) for values in (offsets, normals)]
    launch.launch(find_rectangle, len(offsets), [*arrays, wp.vec3(*right), wp.vec3(*up), found], cpu)
    return found.numpy()


def summed_sphere(cosine: float, sine_squared: float) -> float:
    """The integral of max(cosine, 0) / pi over the cone that a sphere fills."""
    k = (np.arange(SIDE) + 0.5) / SIDE
    along = 1.0 - k[:, None] * (1.0 - np.sqrt(1.0 - sine_squared))  # cosine with the middle
    sine, angle = np.sqrt(1.0 - along**2), 2.0 * np.pi * k[None, :]
    to_normal = np.sqrt(1.0 - cosine**2) * sine * np.cos(angle) + cosine * along
    covers = 2.0 * np.pi * (1.0 - np.sqrt(1.0 - sine_squared))
    return float(covers * np.maximum(to_normal, 0.0).mean() / np.pi)


def test_spheres_above_in_and_below_the_horizon() -> None:
    cosines = [1.0, 0.7, 0.35, 0.2, 0.0, -0.2, -0.35, -0.9, 0.3, 0.0, -0.3, 0.01, -0.01]
    sines_squared = [0.1] * 8 + [0.9] * 3 + [1e-3] * 2
    cpu = launch.resolve_device(None)
    found = wp.zeros(len(cosines), dtype=float, device=cpu)
    given = [wp.array(values, dtype=float, device=cpu) for values in (cosines, sines_squared)]
    launch.launch(find_sphere, len(cosines), [*given, found], cpu)
    expected = [summed_sphere(*pair) for pair in zip(cosines, sines_squared, strict=True)]
    np.testing.assert_allclose(found.numpy(), expected, rtol=1e-4, atol=2e-7)
    assert found.numpy()[0] == pytest.approx(0.1) and found.numpy()[7] == 0.0


@pytest.mark.parametrize("size", [1.0, 30.0, 1e-3])
def test_rectangles_above_in_and_below_the_horizon(size: float) -> None:
    right, up = size * np.array([0.6, 0.0, 0.8]), size * np.array([0.0, 0.5, 0.0])
    axis = np.cross(right, up) / np.linalg.norm(np.cross(right, up))
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(12, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = -size * (rng.uniform(0.5, 3.0, (12, 1)) * axis + rng.uniform(-1.0, 1.0, (12, 3)) * 0.4)
    found = of_rectangles(offsets, normals, right, up)
    k = 2.0 * (np.arange(SIDE) + 0.5) / SIDE - 1.0
    across = (k[:, None, None] * right + k[None, :, None] * up).reshape(-1, 3)
    expected = []
    for offset, normal in zip(offsets, normals, strict=True):
        way = offset + across
        square = np.vecdot(way, way)
        emitted, received = np.maximum(-way @ axis, 0.0), np.maximum(way @ normal, 0.0)
        area = 4.0 * np.linalg.norm(np.cross(right, up))
        expected.append(area * (emitted * received / square**2).mean() / np.pi)
    is_cut = [((o + s) @ n > 0.0) for o, n in zip(offsets, normals, strict=True) for s in (right + up, -right - up)]
    assert 4 < np.count_nonzero(is_cut) < 20
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-7)
    assert (of_rectangles(-offsets, -normals, right, up) == 0.0).all()  # behind it


def test_a_rectangle_sends_all_of_its_light_somewhere() -> None:
    """Over a sphere about it form factors add up to its area."""
    right, up = np.array([0.3, 0.0, 0.0]), np.array([0.0, 0.2, 0.0])
    count, radius = 100_000, 2.0
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    wall = np.stack([np.sqrt(1 - height**2) * np.cos(angle), np.sqrt(1 - height**2) * np.sin(angle), height], axis=1)
    factors = of_rectangles(-radius * wall, -wall, right, up).astype(float)
    assert factors.mean() * 4.0 * np.pi * radius**2 == pytest.approx(4.0 * 0.3 * 0.2, rel=1e-4)
