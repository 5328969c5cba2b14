"""Points of a light: they lie on it, and are spread as they are weighed."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.scene.description import Light
from ldtrefl.shading.light_samples import sample_ambient, sample_light
from ldtrefl.world.records import ShapedLightRecord
from ldtrefl.world.shaped_lights import shaped_light

SIDE = 64
AT = (np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE)), axis=-1).reshape(-1, 2) + 0.5) / SIDE

NORMAL = np.array([0.48, -0.6, 0.64])


@launch.kernel
def sample(
    first: int,
    # In:
    light: ShapedLightRecord,
    offset: wp.vec3,
    normal: wp.vec3,
    points: wp.array(dtype=wp.vec2),
    # Out:
    towards_out: wp.array(dtype=wp.vec3),
    distance_out: wp.array(dtype=float),
    weight_out: wp.array(dtype=float),
):
    """Each thread takes one sample."""
    i = first + wp.tid()
    found = sample_light(light, offset, normal, points[i])
    towards_out[i] = found.towards
    distance_out[i] = found.distance
    weight_out[i] = found.weight


def sampled(light: Light) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions from 0, distances and weights."""
    cpu = launch.resolve_device(None)
    found = [wp.zeros(len(AT), dtype=dtype, device=cpu) for dtype in (wp.vec3, float, float)]
    points = wp.array(AT, dtype=wp.vec2, device=cpu)
    given = [shaped_light(light, np.eye(4)), wp.vec3(*light.position), wp.vec3(*NORMAL), points]
    launch.launch(sample, len(AT), [*given, *found], cpu)
    towards, distance, weight = (array.numpy().astype(float) for array in found)
    return towards, distance, weight


@pytest.mark.parametrize(("radius", "position"), [(1.0, (0.5, -3.0, 2.0)), (1.9, (0, 0, 2)), (1e-4, (3.0, 1.0, -1.0))])
def test_spheres_are_sampled_on_the_near_side_by_solid_angle(radius: float, position: tuple[float, ...]) -> None:
    light = Light(kind="sphere", position=position, radius=radius, radiance=1.0)
    towards, distance, weight = sampled(light)
    away = np.linalg.norm(position)
    np.testing.assert_allclose(np.linalg.norm(towards, axis=1), 1.0, atol=1e-6)
    off = np.linalg.norm(distance[:, None] * towards - position, axis=1) - radius
    assert np.abs(off).max() < 1e-6 * away + 1e-3 * radius and distance.max() < away
    np.testing.assert_allclose(weight, towards @ NORMAL, atol=1e-6)
    # Spread evenly by solid angle, 1 - cosine is spread evenly from 0 to its largest.
    beyond = np.linalg.norm(np.cross(towards, np.array(position) / away), axis=1)
    lower = beyond**2 / (1.0 + np.sqrt(1.0 - beyond**2))
    most = (radius / away) ** 2 / (1.0 + np.sqrt(1.0 - (radius / away) ** 2))
    np.testing.assert_allclose(np.quantile(lower / most, [0.1, 0.5, 0.9]), [0.1, 0.5, 0.9], atol=0.01)


def test_rectangles_are_sampled_all_over_and_weigh_by_what_they_send() -> None:
    light = Light(kind="rectangle", position=(0, 1, 3), direction=(0, -1, -1), width=4.0, height=1.0, radiance=1.0)
    towards, distance, weight = sampled(light)
    right, up, axis = light.axes
    at = distance[:, None] * towards - light.position
    np.testing.assert_allclose(at @ axis, 0.0, atol=1e-5)
    for side, half in ((right, 2.0), (up, 0.5)):
        assert np.abs(at @ side).max() == pytest.approx(half * (1 - 1 / SIDE), rel=1e-4)
        np.testing.assert_allclose(
            np.quantile(at @ side, [0.25, 0.5, 0.75]), np.array([-0.5, 0, 0.5]) * half, atol=0.03
        )
    np.testing.assert_allclose(weight, -(towards @ axis) * (towards @ NORMAL) / distance**2, rtol=1e-5, atol=1e-6)


def test_a_spot_without_radius_is_sampled_in_its_middle() -> None:
    light = Light(kind="spot", position=(0, 1, 3), direction=(0, 0, -1), intensity=1.0)
    towards, distance, _ = sampled(light)
    np.testing.assert_allclose(distance[:, None] * towards, np.tile(light.position, (len(AT), 1)), atol=1e-6)


@launch.kernel
def sample_around(first: int, normal: wp.vec3, points: wp.array(dtype=wp.vec2), towards_out: wp.array(dtype=wp.vec3)):
    """Each thread takes one sample."""
    i = first + wp.tid()
    towards_out[i] = sample_ambient(normal, 1.0, points[i]).towards


def test_ambient_light_is_sampled_by_its_cosine() -> None:
    cpu = launch.resolve_device(None)
    found = wp.zeros(len(AT), dtype=wp.vec3, device=cpu)
    given = [wp.vec3(*NORMAL), wp.array(AT, dtype=wp.vec2, device=cpu), found]
    launch.launch(sample_around, len(AT), given, cpu)
    cosine = found.numpy() @ NORMAL
    # Of a density of cosine / pi the square of the cosine is spread evenly.
    np.testing.assert_allclose(np.quantile(cosine**2, [0.1, 0.5, 0.9]), [0.1, 0.5, 0.9], atol=0.01)
    np.testing.assert_allclose(found.numpy().mean(axis=0), 2.0 / 3.0 * NORMAL, atol=1e-3)
