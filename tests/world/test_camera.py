"""The camera: axes, rays through pixels and pixels of points, and bands that are parts of the whole image."""

import dataclasses

import numpy as np
import pytest
import warp as wp

from ldtrefl.scene.description import Camera
from ldtrefl.world.camera import (
    Band,
    camera_axes,
    camera_ray,
    camera_view,
    pixels_from_world,
    ray_spacing,
    step_down,
    step_right,
    unit_up,
    whole_image,
)

CAMERA = Camera(eye=(1.0, -4.0, 2.0), look_at=(0.3, 0.1, 0.2), up=(0.1, 0.2, 1.0), fov_y=50.0, width=60, height=40)
WORLD = np.eye(4)


def test_axes_are_orthonormal_and_down_goes_down() -> None:
    axes = np.stack(camera_axes(CAMERA))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    right, down, forward = axes
    np.testing.assert_allclose(np.cross(right, down), forward, atol=1e-12)
    assert down @ unit_up(CAMERA) < 0.0 and right @ unit_up(CAMERA) == pytest.approx(0.0, abs=1e-12)
    towards = np.subtract(CAMERA.look_at, CAMERA.eye)
    np.testing.assert_allclose(forward, towards / np.linalg.norm(towards))


def test_equal_cameras_have_the_same_bits() -> None:
    other = dataclasses.replace(CAMERA, eye=(0.0, -4.0, 0.0), look_at=(-0.0, 0.0, -0.0), up=(-0.0, 0.0, 1.0))
    same = dataclasses.replace(CAMERA, eye=(-0.0, -4.0, -0.0), look_at=(0.0, -0.0, 0.0), up=(0.0, -0.0, 1.0))
    assert other == same
    assert np.stack(camera_axes(other)).tobytes() == np.stack(camera_axes(same)).tobytes()


def test_the_height_of_the_image_is_the_field_of_view() -> None:
    view = camera_view(CAMERA, WORLD, whole_image(CAMERA))
    top, bottom = (np.array(camera_ray(view, wp.float64(30.0), wp.float64(y))) for y in (0.0, 40.0))
    cosine = top @ bottom / np.linalg.norm(top) / np.linalg.norm(bottom)
    assert np.degrees(np.arccos(cosine)) == pytest.approx(50.0, abs=1e-3)
    np.testing.assert_allclose(camera_ray(view, wp.float64(30.0), wp.float64(20.0)), camera_axes(CAMERA)[2], atol=1e-6)


def test_points_on_a_ray_are_seen_at_its_pixel_and_depth() -> None:
    view, projection = camera_view(CAMERA, WORLD, whole_image(CAMERA)), pixels_from_world(CAMERA)
    for x, y, depth in ((0.5, 0.5, 3.0), (59.5, 10.5, 0.1), (20.25, 39.75, 1e4)):
        point = np.array(CAMERA.eye) + depth * np.array(camera_ray(view, wp.float64(x), wp.float64(y)), float)
        found = projection @ [*point, 1.0]
        np.testing.assert_allclose(found[:2] / found[2], (x, y), atol=1e-3)
        assert found[2] == pytest.approx(depth, rel=1e-5)


def test_a_band_has_the_rays_of_the_whole_image() -> None:
    whole, band = camera_view(CAMERA, WORLD, whole_image(CAMERA)), camera_view(CAMERA, WORLD, Band(16, 8))
    assert whole_image(CAMERA) == Band(0, 40)
    for x, y in ((0.5, 0.5), (33.5, 7.5)):
        assert tuple(camera_ray(band, wp.float64(x), wp.float64(y))) == tuple(
            camera_ray(whole, wp.float64(x), wp.float64(y + 16.0))
        )


def test_the_eye_is_moved_to_device_space() -> None:
    moved = np.diag([0.5, 0.5, 0.5, 1.0])
    moved[:3, 3] = (1.0, 2.0, 3.0)
    view = camera_view(CAMERA, moved, whole_image(CAMERA))
    np.testing.assert_allclose(view.eye, (1.5, 0.0, 4.0))
    np.testing.assert_array_equal(view.right, camera_view(CAMERA, WORLD, whole_image(CAMERA)).right)
    assert isinstance(view.eye, wp.vec3d)


@pytest.mark.parametrize("samples", [1, 4])
def test_steps_reach_to_the_next_rays(samples: int) -> None:
    view, reach = camera_view(CAMERA, WORLD, whole_image(CAMERA), samples), {1: 1.0, 4: 0.3}[samples]
    ray, right, below = (
        np.array(camera_ray(view, wp.float64(x), wp.float64(y))) for x, y in ((5.5, 8.5), (6.5, 8.5), (5.5, 9.5))
    )
    np.testing.assert_allclose(step_right(view), reach * (right - ray), atol=1e-6)
    np.testing.assert_allclose(step_down(view), reach * (below - ray), atol=1e-6)


def test_rays_of_a_pixel_reach_less_far_the_more_they_are() -> None:
    assert [ray_spacing(n) for n in (1, 4, 16)] == pytest.approx([1.0, 0.3, 0.15])
