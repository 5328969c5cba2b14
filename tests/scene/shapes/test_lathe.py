"""The lathe: a B-spline turned about z."""

import numpy as np
import pytest

from ldtrefl import InputError
from ldtrefl.scene import shapes
from ldtrefl.scene.shapes.lathe import spline
from tests.scene.shapes.test_base import assert_estimate_holds, welded


def test_a_straight_profile_makes_a_cone() -> None:
    """Radius 1 above, 1/3 below, height 2: the slant is 2/3 over 2, and so are the normals."""
    mesh = shapes.make("lathe", {"profile": [[0.5, 0.0], [1.0, 1.5], [1.5, 3.0]], "segments": [256, 8]})
    radius, z = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]), mesh.vertices[:, 2]
    np.testing.assert_allclose(radius, (2.0 + z) / 3.0, atol=1e-12)
    np.testing.assert_allclose(mesh.normals[:, 2], -1.0 / np.sqrt(10.0), atol=1e-4)
    area = welded("lathe", {"profile": [[0.5, 0.0], [1.0, 1.5], [1.5, 3.0]], "segments": [256, 8]}).area
    assert area == pytest.approx(np.pi * (1.0 + 1.0 / 3.0) * np.hypot(2.0, 2.0 / 3.0), rel=1e-3)


def test_the_curve_is_a_uniform_cubic_b_spline() -> None:
    """At a knot, a sixth of the neighbours and two thirds of the point; at an end the point, or level on the axis."""
    control = np.array([[0.0, 0.0], [3.0, 0.6], [3.0, 3.0], [1.5, 6.0]])
    curve = spline(control, 300)
    np.testing.assert_allclose(curve[[0, 100, 200, 300]], [[0.0, 0.2], [2.5, 0.9], [2.75, 3.1], [1.5, 6.0]])
    assert curve[0, 0] == 0.0
    rise = np.diff(curve, axis=0)
    assert abs(rise[0, 1] / rise[0, 0]) < 0.01
    bend = np.diff(rise, axis=0) * 100.0**2  # the second derivative has no jumps; the third, up to 16.5, has
    assert np.abs(np.diff(bend, axis=0)).max() < 0.2


def test_a_convex_profile_makes_a_convex_solid() -> None:
    body = welded("lathe")
    assert body.is_watertight and body.euler_number == 2
    assert body.volume == pytest.approx(body.convex_hull.volume, rel=1e-9)


def test_open_ends_stay_open() -> None:
    params: dict[str, object] = {"profile": [[1.0, 0.0], [0.6, 1.0]], "segments": [40, 3]}
    tube = welded("lathe", params)
    assert not tube.is_watertight and tube.euler_number == 0
    assert_estimate_holds("lathe", params)


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        ([[1.0, 0.0]], r"^params: profile: .*at least 2"),
        ([[-0.1, 0.0], [1.0, 1.0]], r"^params: profile\[0\]\[0\]: should be greater than or equal to 0, got -0\.1"),
        ([[0.0, 0.0], [0.0, 1.0]], "the mesh has no triangles"),
    ],
)
def test_a_profile_of_no_surface_is_refused(profile: list[list[float]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        shapes.make("lathe", {"profile": profile})
