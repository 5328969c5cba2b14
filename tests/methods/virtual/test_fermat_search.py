"""The search for reflections: its gradient against finite differences, its steps, and what it finds on ellipsoids.

Alhazen's problem is in ``tests/test_reflection_point.py``."""

import numpy as np
import pytest
import warp as wp
from scipy.optimize import minimize

from ldtrefl.device import launch
from ldtrefl.methods.virtual.fermat_search import grazing_gradient, path_gradient, weights_of_zero
from tests.methods.virtual.ellipsoids import directions, grazing_pairs, heights_between, random_pairs, reflections

CPU = "cpu"


@launch.kernel
def find_gradients(
    first: int,
    # In:
    points: wp.array(dtype=wp.vec3d),
    normals: wp.array(dtype=wp.vec3d),
    eyes: wp.array(dtype=wp.vec3d),
    vertices: wp.array(dtype=wp.vec3d),
    # Out:
    of_path_out: wp.array(dtype=wp.vec3d),
    grazing_out: wp.array(dtype=wp.vec3d),
):
    """Each thread finds the gradient of the way by one point, and what is added for grazing incidence."""
    i = first + wp.tid()
    of_path_out[i] = path_gradient(points[i], normals[i], eyes[i], vertices[i])
    grazing_out[i] = grazing_gradient(points[i], normals[i], eyes[i], vertices[i])


@launch.kernel
def find_weights(
    first: int,
    # In:
    a: wp.array(dtype=wp.vec3d),
    b: wp.array(dtype=wp.vec3d),
    c: wp.array(dtype=wp.vec3d),
    # Out:
    weights_out: wp.array(dtype=wp.vec3d),
):
    """Each thread finds the weights at which three gradients are smallest."""
    i = first + wp.tid()
    weights_out[i] = weights_of_zero(a[i], b[i], c[i])


def run(kernel: wp.Kernel, inputs: list[np.ndarray], outputs: int) -> list[np.ndarray]:
    device, count = wp.get_device(CPU), len(inputs[0])
    given = [wp.array(values, dtype=wp.vec3d, device=device) for values in inputs]
    found = [wp.zeros(count, dtype=wp.vec3d, device=device) for _ in range(outputs)]
    launch.launch(kernel, count, [*given, *found], device)
    return [each.numpy() for each in found]


def dots(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


def tangents(normals: np.ndarray) -> np.ndarray:
    across = np.cross(normals, directions(len(normals)))
    return across / np.linalg.norm(across, axis=1, keepdims=True)


def test_the_gradient_is_the_difference_of_path_lengths() -> None:
    points = directions(500)
    eyes, vertices = 3.0 * directions(500), 2.0 * directions(500)
    gradients, _ = run(find_gradients, [points, points, eyes, vertices], 2)
    along, step = tangents(points), 1e-6
    ahead, behind = (points + way * along for way in (step, -step))
    lengths = [np.linalg.norm(p - eyes, axis=1) + np.linalg.norm(p - vertices, axis=1) for p in (ahead, behind)]
    assert np.allclose(dots(gradients, along), (lengths[0] - lengths[1]) / (2 * step), atol=1e-8)
    assert np.allclose(dots(gradients, points), 0.0, atol=1e-12)


def test_equation_1_is_the_same_gradient_over_directions() -> None:
    # P = O + r(u) u on an ellipsoid: equation (1) and e along the surface vanish together, and agree by the chain rule.
    axes, step = np.array([1.0, 1.5, 0.7]), 1e-6
    ways = directions(300)
    along = tangents(ways)

    def point(u: np.ndarray) -> np.ndarray:
        return u * (dots(u / axes, u / axes) ** -0.5)[:, None]

    normals = point(ways) / axes**2
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    eyes, vertices = 3.0 * directions(300), 2.0 * directions(300)
    gradients, _ = run(find_gradients, [point(ways), normals, eyes, vertices], 2)
    moved = (point(ways + step * along) - point(ways - step * along)) / (2 * step)
    radii = np.linalg.norm(point(ways), axis=1)
    grad_r_along = -(radii**3) * dots(ways / axes**2, along)
    e = -sum((q - point(ways)) / np.linalg.norm(q - point(ways), axis=1, keepdims=True) for q in (eyes, vertices))
    equation_1 = dots(e, ways) * grad_r_along + radii * dots(e, along)
    assert np.allclose(dots(gradients, moved), equation_1, atol=1e-7)


def test_what_is_added_for_grazing_incidence_leaves_reflections_and_turns_nothing_round() -> None:
    points = directions(2000)
    eyes, vertices = points + 2.0 * directions(2000), points + 3.0 * directions(2000)
    gradients, added = run(find_gradients, [points, points, eyes, vertices], 2)
    sees_both = (dots(eyes - points, points) > 0.0) & (dots(vertices - points, points) > 0.0)
    assert sees_both.sum() > 300
    assert np.all(dots(gradients, added)[sees_both] >= -1e-15)
    view = (points - eyes) / np.linalg.norm(points - eyes, axis=1, keepdims=True)
    mirrored = points + 2.5 * (view - 2.0 * dots(view, points)[:, None] * points)
    gradients, added = run(find_gradients, [points, points, eyes, mirrored], 2)
    assert np.allclose(gradients, 0.0, atol=1e-12) and np.allclose(added, 0.0, atol=1e-12)


def test_weights_are_the_least_squares() -> None:
    a, b, c = directions(100), 3.0 * directions(100), 0.5 * directions(100)
    (weights,) = run(find_weights, [a, b, c], 1)
    for i in range(100):
        solved, *_ = np.linalg.lstsq(np.stack([a[i] - c[i], b[i] - c[i]], axis=1), -c[i], rcond=None)
        assert np.allclose(weights[i, :2], solved, atol=1e-8)
    assert np.all((weights[:, 2] > 0.0) & (weights[:, 2] <= 1.0))
    (none,) = run(find_weights, [a, a, c], 1)
    assert np.all(none[:, 2] < 1e-12)


@pytest.mark.parametrize("axes", [(1.0, 1.0, 1.0), (1.0, 1.3, 1.6), (1.0, 1.0, 2.5), (1.0, 1.0, 0.3)])
@pytest.mark.parametrize("pairs", [random_pairs, grazing_pairs])
def test_points_are_found_on_ellipsoids(axes: tuple[float, float, float], pairs: object) -> None:
    assert callable(pairs)
    eyes, points = pairs(4000)
    found = reflections(axes, eyes * axes, points * axes)
    is_found = found["is_found"] == 1
    print(axes, pairs.__name__, is_found.mean(), np.percentile(found["iterations"], [5, 50, 95, 99]))
    round_enough = max(axes) / min(axes) <= 2.0
    assert is_found.mean() >= (0.999 if round_enough else 0.98)
    assert found["residual"][is_found].max() <= 1e-5
    assert np.median(found["iterations"]) <= 10 and found["iterations"].max() <= 20
    on_surface = np.linalg.norm(found["point"] / axes, axis=1)
    assert np.allclose(on_surface[is_found], 1.0, atol=1e-12)


def test_what_is_found_is_the_shortest_way() -> None:
    axes = np.array([1.0, 1.3, 0.8])
    eyes, points = random_pairs(60)
    eyes, points = eyes * axes, points * axes
    found = reflections((1.0, 1.3, 0.8), eyes, points)

    def length(angles: np.ndarray, eye: np.ndarray, point: np.ndarray) -> float:
        polar, around = angles
        at = axes * [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
        return float(np.linalg.norm(at - eye) + np.linalg.norm(at - point))

    for i in range(len(eyes)):
        start = found["point"][i] / axes
        angles = [np.arccos(np.clip(start[2], -1.0, 1.0)) + 0.02, np.arctan2(start[1], start[0]) - 0.02]
        best = minimize(length, angles, (eyes[i], points[i]), method="Nelder-Mead", options={"xatol": 1e-10})
        here = np.linalg.norm(found["point"][i] - eyes[i]) + np.linalg.norm(found["point"][i] - points[i])
        assert here <= best.fun + 1e-9


def test_what_stands_behind_is_not_found() -> None:
    eyes, points = (3.0 * directions(2000) for _ in range(2))
    is_hidden = heights_between(eyes, points) < 0.0
    found = reflections((1.0, 1.0, 1.0), eyes[is_hidden], points[is_hidden])
    assert is_hidden.sum() > 100 and not found["is_found"].any()


def test_points_inside_see_the_inside() -> None:
    eyes, points = (0.5 * directions(1000) for _ in range(2))
    found = reflections((1.0, 1.0, 1.0), eyes, points)
    assert found["is_found"].mean() > 0.85  # the paper's second zone is unstable
    outside = reflections((1.0, 1.0, 1.0), 3.0 * eyes, points)
    assert not outside["is_found"].any()


def test_a_search_ends_when_it_may() -> None:
    eyes, points = random_pairs(2000)
    exact = reflections((1.0, 1.0, 1.0), eyes, points)
    short = reflections((1.0, 1.0, 1.0), eyes, points, most_iterations=3)
    early = reflections((1.0, 1.0, 1.0), eyes, points, least_solid_angle=1e-6)
    assert short["iterations"].max() == 3 and short["is_found"].mean() < 0.5
    assert early["iterations"].mean() < exact["iterations"].mean() - 1.0


def test_the_search_of_an_open_surface_stays_on_it() -> None:
    # The lower three quarters of a sphere, seen from outside: what the whole sphere mirrors there is found.
    eyes, points = random_pairs(4000)
    whole = reflections((1.0, 1.0, 1.0), eyes, points)
    is_there = (whole["is_found"] == 1) & (whole["point"][:, 2] < 0.4)
    is_gone = (whole["is_found"] == 1) & (whole["point"][:, 2] > 0.5)
    part = reflections((1.0, 1.0, 1.0), eyes, points, highest=0.5)
    assert part["is_found"][is_there].mean() > 0.97
    assert part["point"][is_there & (part["is_found"] == 1), 2].max() <= 0.5
    # Where the cap is gone some see the inside by the opening; nothing else is found.
    found = part[is_gone & (part["is_found"] == 1)]
    assert len(found) and np.all(dots(found["normal"], eyes[is_gone & (part["is_found"] == 1)] - found["point"]) < 0.0)
