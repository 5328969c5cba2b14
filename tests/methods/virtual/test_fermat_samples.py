"""Samples of the search for reflections: gradients against finite differences, and the weights of their zero."""

import numpy as np
import warp as wp

from ldtrefl.device import launch
from ldtrefl.methods.virtual.fermat_samples import grazing_gradient, path_gradient, weights_of_zero
from tests.methods.virtual.ellipsoids import directions, dots

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
