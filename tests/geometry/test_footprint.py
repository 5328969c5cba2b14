"""Footprints against closed forms: planes, flat mirrors and spheres, and rays beside the ray itself."""

import numpy as np
import pytest
import warp as wp

from ldtrefl.device import launch
from ldtrefl.geometry.footprint import Footprint, is_same_footprint, turn_when_mirrored

RADIUS = 0.7


@launch.kernel
def mirror(
    first: int,
    # In:
    footprints: wp.array(dtype=Footprint),  # where rays meet it
    direction: wp.array(dtype=wp.vec3),
    normal: wp.array(dtype=wp.vec3),
    curvature: float,  # of the mirror: normals turn by it over a length
    # Out:
    met_out: wp.array(dtype=Footprint),
    leaving_out: wp.array(dtype=wp.vec3),
):
    """Let one ray leave a mirror."""
    i = first + wp.tid()
    met = footprints[i]
    leaving = wp.normalize(direction[i] - 2.0 * wp.dot(direction[i], normal[i]) * normal[i])
    x = turn_when_mirrored(met.turn_x, direction[i], normal[i], curvature * met.place_x, leaving)
    y = turn_when_mirrored(met.turn_y, direction[i], normal[i], curvature * met.place_y, leaving)
    met.turn_x = x
    met.turn_y = y
    met_out[i] = met
    leaving_out[i] = leaving


def unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def mirrored_by_kernel(
    place: np.ndarray, turn: np.ndarray, direction: np.ndarray, t: np.ndarray, normal: np.ndarray, curvature: float
) -> tuple[np.ndarray, np.ndarray]:
    """((n, 2, 3) places, turns) after the mirror, of (n, 2, 3) before it."""
    device, count = launch.resolve_device(None), len(t)
    given = np.zeros(count, Footprint.numpy_dtype())
    apart = place + t[:, None, None] * turn
    cosine = (direction * normal).sum(axis=-1)[:, None, None]
    on_plane = apart - (apart * normal[:, None]).sum(axis=-1, keepdims=True) / cosine * direction[:, None]
    for axis, name in enumerate("xy"):
        given[f"place_{name}"], given[f"turn_{name}"] = on_plane[:, axis], turn[:, axis]
    met, leaving = wp.empty(count, dtype=Footprint, device=device), wp.empty(count, dtype=wp.vec3, device=device)
    vectors = [wp.array(values, dtype=wp.vec3, device=device) for values in (direction, normal)]
    inputs = [wp.array(given, dtype=Footprint, device=device), *vectors, curvature]
    launch.launch(mirror, count, [*inputs, met, leaving], device)
    made = met.numpy()
    return tuple(np.stack([made[f"{kind}_{name}"] for name in "xy"], axis=1) for kind in ("place", "turn"))  # type: ignore[return-value]


def on_sphere(origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(t, where rays meet a sphere about 0, the direction in which they leave), float64."""
    along = (origin * direction).sum(axis=-1)
    t = -along - np.sqrt(along**2 - (origin**2).sum(axis=-1) + RADIUS**2)
    point = origin + t[..., None] * direction
    normal = point / RADIUS
    return t, point, direction - 2 * (direction * normal).sum(axis=-1, keepdims=True) * normal


def test_a_sphere_spreads_rays_as_the_rays_beside_them_say() -> None:
    rng, h = np.random.default_rng(3), 1e-6
    origin = np.tile([0.0, 0.0, 3.0], (200, 1))
    direction = unit(RADIUS * rng.uniform(-0.6, 0.6, (200, 3)) - origin)
    turn = rng.normal(size=(200, 2, 3))
    turn -= (turn * direction[:, None]).sum(axis=-1, keepdims=True) * direction[:, None]
    place = rng.normal(size=(200, 2, 3))
    t, point, leaving = on_sphere(origin, direction)
    beside = on_sphere(origin[:, None] + h * place, unit(direction[:, None] + h * turn))
    before = on_sphere(origin[:, None] - h * place, unit(direction[:, None] - h * turn))
    places, turns = mirrored_by_kernel(place, turn, direction, t, point / RADIUS, 1.0 / RADIUS)
    for found, k in ((places, 1), (turns, 2)):
        expected = (beside[k] - before[k]) / (2 * h)
        np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(expected).max())
    assert np.abs((turns * leaving[:, None]).sum(axis=-1)).max() < 1e-4 * np.abs(turns).max()


@pytest.mark.parametrize("degrees", [0.0, 40.0, 75.0])
def test_a_sphere_turns_rays_by_two_over_its_radius_and_the_cosine(degrees: float) -> None:
    """Parallel rays a length apart turn by 2 / (R cos) of it in the plane of reflection, and by 2 cos / R across."""
    angle = np.radians(degrees)
    normal, direction = np.array([[np.sin(angle), 0.0, np.cos(angle)]]), np.array([[0.0, 0.0, -1.0]])
    place = np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    _, turns = mirrored_by_kernel(place, np.zeros((1, 2, 3)), direction, np.array([2.0]), normal, 1.0 / RADIUS)
    expected = [2 / (RADIUS * np.cos(angle)), 2 * np.cos(angle) / RADIUS]
    np.testing.assert_allclose(np.linalg.norm(turns[0], axis=-1), expected, rtol=1e-5)


def test_a_flat_mirror_leaves_the_footprint_of_the_mirrored_eye() -> None:
    """After t to the mirror and s on, rays are as far apart as after t + s from the virtual image of the eye."""
    rng = np.random.default_rng(4)
    normal, direction = np.tile([0.0, 0.0, 1.0], (50, 1)), unit(rng.uniform(-1.0, 1.0, (50, 3)) - [0.0, 0.0, 1.5])
    turn = rng.normal(size=(50, 2, 3))
    turn -= (turn * direction[:, None]).sum(axis=-1, keepdims=True) * direction[:, None]
    t, s = rng.uniform(0.5, 4.0, 50), 2.5
    places, turns = mirrored_by_kernel(np.zeros((50, 2, 3)), turn, direction, t, normal, 0.0)
    flip = np.array([1.0, 1.0, -1.0])
    leaving = (flip * direction)[:, None]
    apart = places + s * turns
    across = apart - (apart * leaving).sum(axis=-1, keepdims=True) * leaving
    np.testing.assert_allclose(across, (t + s)[:, None, None] * flip * turn, atol=2e-5)


@launch.kernel
def compare(first: int, footprints: wp.array(dtype=Footprint), same_out: wp.array(dtype=wp.int32)):
    """Compare one footprint with the first."""
    i = first + wp.tid()
    same_out[i] = wp.where(is_same_footprint(footprints[0], footprints[i]), 1, 0)


def test_footprints_that_differ_anywhere_are_not_the_same() -> None:
    given = np.zeros(14, Footprint.numpy_dtype())
    for k, name in enumerate(("place_x", "place_y", "turn_x", "turn_y")):
        given[name][2 + 3 * k : 5 + 3 * k] = np.eye(3)
    device = launch.resolve_device(None)
    same = wp.empty(14, dtype=wp.int32, device=device)
    launch.launch(compare, 14, [wp.array(given, dtype=Footprint, device=device), same], device)
    assert same.numpy().tolist() == [1, 1] + [0] * 12
