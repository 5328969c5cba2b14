"""Where things lie in a cube map: texels, cameras, and nearness between texels."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.cube_maps.faces import (
    CubeLayer,
    cube_face,
    face_axes,
    face_camera,
    look_near,
    look_up,
    look_up_surface,
    texel_points,
)
from ldtrefl.world.camera import camera_axes
from tests.methods.cube_maps.rooms import HIGH, LOW, exits_of_box, layer_of, texels, unit


@launch.kernel
def read_near(
    first: int,
    nearness: wp.array(dtype=float),
    resolution: int,
    directions: wp.array(dtype=wp.vec3),
    face_out: wp.array(dtype=wp.int32),
    near_out: wp.array(dtype=float),
):
    """Read a map in one direction."""
    i = first + wp.tid()
    face_out[i] = cube_face(directions[i])
    near_out[i] = look_near(nearness, resolution, directions[i])


@launch.kernel
def read_radiance(
    first: int,
    layer: CubeLayer,
    resolution: int,
    directions: wp.array(dtype=wp.vec3),
    surface_out: wp.array(dtype=wp.vec3),
    blended_out: wp.array(dtype=wp.vec3),
):
    """Read a map's radiance in one direction, in both ways."""
    i = first + wp.tid()
    surface_out[i] = look_up_surface(layer, resolution, directions[i])
    blended_out[i] = look_up(layer.radiance, resolution, directions[i])


def read(distance: np.ndarray, resolution: int, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) faces and (n,) distances that a map of (6 * resolution^2,) distances has in (n, 3) directions."""
    device, count = launch.resolve_device(None), len(directions)
    layer = layer_of(distance, np.zeros((len(distance), 3)), resolution)
    face, near = wp.empty(count, dtype=wp.int32, device=device), wp.empty(count, dtype=float, device=device)
    ways = wp.array(directions.astype(np.float32), dtype=wp.vec3, device=device)
    launch.launch(read_near, count, [layer.nearness, resolution, ways, face, near], device)
    with np.errstate(divide="ignore"):
        return face.numpy(), 1.0 / near.numpy()


@pytest.mark.parametrize("face", range(6))
def test_a_faces_camera_looks_along_its_axis(face: int) -> None:
    forward, right, up = face_axes(face)
    assert forward[face // 2] == (1 if face % 2 == 0 else -1) and np.abs(forward).sum() == 1
    camera = face_camera(face, np.array([1.0, 2.0, 3.0]), 0.5, 16)
    axes = camera_axes(camera)
    np.testing.assert_allclose(axes, (right, -up, forward), atol=1e-12)
    assert camera.fov_y == 90.0 and (camera.width, camera.height) == (16, 16)


def test_rows_of_texels_are_those_of_the_whole_face() -> None:
    whole = texel_points(3, 8)
    np.testing.assert_array_equal(texel_points(3, 8, 5, 2), whole.reshape(8, 8, 3)[5:7].reshape(-1, 3))
    assert whole[0].tolist() == [0.875, -1.0, 0.875]  # -y, upper left: its camera has +x to its left


def test_texels_lie_on_their_faces() -> None:
    faces, distance = read(np.arange(6 * 25) + 1.0, 5, unit(texels(5)))
    np.testing.assert_array_equal(faces, np.repeat(np.arange(6), 25))
    np.testing.assert_allclose(distance, np.arange(6 * 25) + 1.0, rtol=1e-6)


def test_between_texels_a_plane_is_exact() -> None:
    """Walls of a box, but for the half texel at a face's border and where two walls meet."""
    resolution, directions = 64, unit(np.random.default_rng(3).normal(size=(4000, 3)))
    distance = exits_of_box(np.zeros(3), unit(texels(resolution)), LOW, HIGH)
    expected = exits_of_box(np.zeros(3), directions, LOW, HIGH)
    off = np.abs(read(distance, resolution, directions)[1] / expected - 1.0)
    assert np.quantile(off, 0.9) < 1e-6 and off.max() < 2.0 / resolution


def test_radiance_is_that_of_one_surface() -> None:
    """White at 1 about the x axis, black at 3 around it: nothing between is grey, as it is if all is blended."""
    resolution, device = 64, launch.resolve_device(None)
    directions, ways = unit(np.random.default_rng(3).normal(size=(4000, 3))), unit(texels(resolution))
    is_near = np.abs(ways[:, 0]) > 0.85
    layer = layer_of(np.where(is_near, 1.0, 3.0), np.repeat(is_near[:, None], 3, axis=1).astype(float), resolution)
    given = wp.array(directions.astype(np.float32), dtype=wp.vec3, device=device)
    found, blended = (wp.empty(len(directions), dtype=wp.vec3, device=device) for _ in range(2))
    launch.launch(read_radiance, len(directions), [layer, resolution, given, found, blended], device)
    is_white = found.numpy()[:, 0] > 0.5
    np.testing.assert_allclose(found.numpy(), np.repeat(is_white[:, None], 3, axis=1), atol=1e-6)
    sure = np.abs(np.abs(directions[:, 0]) - 0.85) > 2.0 / resolution
    np.testing.assert_array_equal(is_white[sure], np.abs(directions[sure, 0]) > 0.85)
    assert ((blended.numpy()[:, 0] > 0.1) & (blended.numpy()[:, 0] < 0.9)).sum() > 20


def test_one_object_before_another_is_not_blended() -> None:
    resolution, directions = 64, unit(np.random.default_rng(3).normal(size=(4000, 3)))
    is_near = unit(texels(resolution))[:, 0] > 0.85
    distance = read(np.where(is_near, 1.0, np.inf), resolution, directions)[1]
    assert np.isinf(distance).any() and (distance < np.inf).any()
    np.testing.assert_allclose(distance[distance < np.inf], 1.0, rtol=0.02)
