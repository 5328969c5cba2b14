"""Three-quarter views: the closest camera whose picture has all points within its margin."""

import numpy as np
import pytest

from ldtrefl.scene.framing import AZIMUTH, FOV_Y, MARGIN, closest_eye, three_quarter_camera, towards, view_axes
from ldtrefl.scene.layout import CORNERS
from ldtrefl.world.camera import camera_axes

PLAIN = (np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]))


def test_directions_turn_from_the_front_to_the_right_and_up() -> None:
    np.testing.assert_allclose(towards(0.0, 0.0), [0.0, -1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(towards(90.0, 0.0), [1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(towards(33.0, 90.0), [0.0, 0.0, 1.0], atol=1e-15)
    right, up, forward = view_axes(20.0)
    assert right[2] == 0.0 and up[2] == pytest.approx(np.cos(np.radians(20.0))) and forward[2] < 0.0 < min(forward[:2])
    np.testing.assert_allclose(np.cross(right, forward), up)


def test_a_square_fills_the_picture_from_as_far_as_its_side_over_the_slopes() -> None:
    square = np.array([[x, 5.0, z] for x in (2.0, 4.0) for z in (-1.0, 1.0)])
    np.testing.assert_allclose(closest_eye(square, PLAIN, (0.5, 0.25)), [3.0, 5.0 - 1.0 / 0.25, 0.0])
    np.testing.assert_allclose(closest_eye(square, PLAIN, (0.1, 0.25)), [3.0, 5.0 - 1.0 / 0.1, 0.0])


def test_of_a_far_and_a_near_point_the_eye_finds_the_middle_of_what_is_seen() -> None:
    """Seen from the eye, a point at x = 1 one ahead and one at x = -3 three ahead are both at slope 1: the eye is at
    x = 0."""
    np.testing.assert_allclose(
        closest_eye(np.array([[1.0, 1.0, 0.0], [-3.0, 3.0, 0.0]]), PLAIN, (1.0, 1.0)), [0.0] * 3, atol=1e-15
    )


@pytest.mark.parametrize("size", [None, (768, 512), (300, 900), (900, 300), (1, 1)])
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-6, 1e-3), (1e6, -1e6), (1e-3, 1e3)])
def test_all_points_are_within_the_margin_and_two_touch_it(
    size: tuple[int, int] | None, scale: float, offset: float
) -> None:
    rng = np.random.default_rng(1)
    points = offset + scale * rng.normal(size=(40, 3)) * (1.0, 2.0, 0.5)
    digits = 8 - round(np.log10(scale))
    camera = three_quarter_camera(points, 20.0, size, digits)
    right, down, forward = camera_axes(camera)
    np.testing.assert_allclose(forward, -towards(AZIMUTH, 20.0), atol=1e-6)
    x, y, z = ((points - camera.eye) @ np.stack([right, down, forward], axis=1)).T
    slope = np.tan(np.radians(FOV_Y / 2.0))
    across = x / z / slope * camera.height / 2.0 + camera.width / 2.0
    along = y / z / slope * camera.height / 2.0 + camera.height / 2.0
    free = min(across.min(), along.min(), camera.width - across.max(), camera.height - along.max())
    assert z.min() > 0.0 and free == pytest.approx(MARGIN * min(camera.width, camera.height), rel=1e-4)
    touches = np.isclose([across.min(), camera.width - across.max()], free, rtol=1e-3).all()
    touches |= np.isclose([along.min(), camera.height - along.max()], free, rtol=1e-3).all()
    assert touches and np.linalg.norm(np.subtract(camera.look_at, camera.eye)) == pytest.approx(z.min(), rel=1e-5)


def test_without_a_size_the_picture_is_upright_if_that_is_closer() -> None:
    corners = np.where(CORNERS == 0, -1.0, 1.0)
    tall, wide = (three_quarter_camera(corners * sides, 20.0, None, 6) for sides in ((1, 1, 3), (3, 3, 1)))
    assert (tall.width, tall.height) == (512, 768) and (wide.width, wide.height) == (768, 512)
