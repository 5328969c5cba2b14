"""Vectors of two precisions: conversions, differences far from 0, and the sides of boxes."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.vectors import as_double, as_single, from_to, high_side, low_side, point_along

FAR = np.array([[1e6, -2e6, 3e6], [1e6 + 1e-4, -2e6 + 2e-4, 3e6 - 3e-4], [0.1, 0.2, -0.3]])


@launch.kernel
def convert(
    first: int,
    # In:
    points: wp.array(dtype=wp.vec3d),
    others: wp.array(dtype=wp.vec3d),
    t: float,
    # Out:
    single_out: wp.array(dtype=wp.vec3),
    offset_out: wp.array(dtype=wp.vec3),
    along_out: wp.array(dtype=wp.vec3d),
    double_out: wp.array(dtype=wp.vec3d),
    low_out: wp.array(dtype=wp.vec3d),
    high_out: wp.array(dtype=wp.vec3d),
):
    """Each thread converts one pair of points."""
    i = first + wp.tid()
    a, b = points[i], others[i]
    single_out[i] = as_single(a)
    double_out[i] = as_double(as_single(a))
    offset_out[i] = from_to(a, b)
    along_out[i] = point_along(a, from_to(a, b), t)
    low_out[i] = low_side(a, b)
    high_out[i] = high_side(a, b)


def converted(points: np.ndarray, others: np.ndarray, t: float) -> dict[str, np.ndarray]:
    device = launch.resolve_device(None)
    types = {"single": wp.vec3, "offset": wp.vec3, "along": wp.vec3d, "double": wp.vec3d}
    types |= {"low": wp.vec3d, "high": wp.vec3d}
    found = {name: wp.zeros(len(points), dtype=dtype, device=device) for name, dtype in types.items()}
    given = [wp.array(array, dtype=wp.vec3d, device=device) for array in (points, others)]
    launch.launch(convert, len(points), [*given, t, *found.values()], device)
    return {name: array.numpy() for name, array in found.items()}


def test_vectors_of_both_precisions() -> None:
    others = np.roll(FAR, 1, axis=0)
    found = converted(FAR, others, 0.25)
    np.testing.assert_array_equal(found["single"], FAR.astype(np.float32))
    np.testing.assert_array_equal(found["double"], FAR.astype(np.float32).astype(float))
    np.testing.assert_array_equal(found["offset"], (others - FAR).astype(np.float32))
    np.testing.assert_array_equal(found["along"], FAR + 0.25 * found["offset"].astype(float))


def test_neighbours_far_away_keep_their_distance() -> None:
    offset = converted(FAR[:1], FAR[1:2], 0.0)["offset"][0]
    np.testing.assert_allclose(offset, [1e-4, 2e-4, -3e-4], rtol=1e-5)


def test_sides_of_a_box() -> None:
    a, b = np.array([[1.0, 5.0, -0.0], [0.0, -2.0, 7.0]]), np.array([[3.0, 4.0, 0.0], [-0.0, -2.0, 8.0]])
    found = converted(a, b, 0.0)
    np.testing.assert_array_equal(found["low"], np.minimum(a, b))
    np.testing.assert_array_equal(found["high"], np.maximum(a, b))
    # Of 0 and -0 both take the second.
    assert not np.signbit(found["low"][0, 2]) and not np.signbit(found["high"][0, 2])
    assert np.signbit(found["low"][1, 0]) and np.signbit(found["high"][1, 0])
