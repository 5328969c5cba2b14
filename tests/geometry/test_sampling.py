"""Points spread over a disc and over directions."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.sampling import about, across, on_disc


@launch.kernel
def spread(first: int, points: wp.array(dtype=wp.vec2), disc_out: wp.array(dtype=wp.vec2)):
    """Each thread places one point."""
    i = first + wp.tid()
    disc_out[i] = on_disc(points[i])


def test_areas_of_the_square_are_kept_on_the_disc() -> None:
    side = 200
    at = (np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) + 0.5) / side
    cpu = launch.resolve_device(None)
    disc = wp.zeros(len(at), dtype=wp.vec2, device=cpu)
    launch.launch(spread, len(at), [wp.array(at, dtype=wp.vec2, device=cpu), disc], cpu)
    disc = disc.numpy()
    radius = np.linalg.norm(disc, axis=1)
    assert radius.max() < 1.0
    for r in (0.3, 0.6, 0.9):
        assert (radius < r).mean() == pytest.approx(r * r, abs=2e-3)
    np.testing.assert_allclose(disc.mean(axis=0), 0.0, atol=1e-6)
    # Of a unit disc the mean of x^2, y^2 and xy are 1/4, 1/4 and 0.
    np.testing.assert_allclose(disc.T @ disc / len(disc), np.eye(2) / 4, atol=1e-4)
    assert tuple(on_disc(wp.vec2(0.5, 0.5))) == (0.0, 0.0)


@launch.kernel
def turn(
    first: int,
    # In:
    axes: wp.array(dtype=wp.vec3),
    parts: wp.vec3,
    # Out:
    side_out: wp.array(dtype=wp.vec3),
    made_out: wp.array(dtype=wp.vec3),
):
    """Each thread makes a vector about one axis."""
    i = first + wp.tid()
    side_out[i] = across(axes[i])
    made_out[i] = about(axes[i], parts[0], parts[1], parts[2])


def test_directions_about_an_axis() -> None:
    axes = np.array([(0, 0, 1), (0, 0, -1), (0.6, 0, -0.8), (-0.48, 0.6, 0.64), (1, 0, 0)])
    cpu = launch.resolve_device(None)
    side, made = (wp.zeros(len(axes), dtype=wp.vec3, device=cpu) for _ in range(2))
    parts = wp.vec3(0.36, -0.48, 0.8)
    launch.launch(turn, len(axes), [wp.array(axes, dtype=wp.vec3, device=cpu), parts, side, made], cpu)
    for vectors, along in ((side.numpy(), 0.0), (made.numpy(), 0.8)):
        np.testing.assert_allclose(np.vecdot(vectors, axes), along, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.vecdot(made.numpy(), side.numpy()), 0.36, atol=1e-6)
